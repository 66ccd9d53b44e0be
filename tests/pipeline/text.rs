//! Text layout: shaping, order, alignment, errors.
