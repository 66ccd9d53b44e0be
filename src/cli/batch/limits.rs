//! What one item may cost.

use crate::cli::values::positive_f64;
use crate::outline::svg::SvgLimits;
use std::time::Duration;

/// What one item may cost; what passes a limit fails, and is named.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Limits of an item")]
pub struct LimitArgs {
    /// Seconds from beginning to end
    #[arg(long, value_name = "SECONDS", default_value_t = 60.0, value_parser = positive_f64)]
    time_limit: f64,
    /// MiB of memory beyond what template and picture take (Linux)
    #[arg(long, value_name = "MIB", default_value_t = 768, value_parser = clap::value_parser!(u64).range(1..=1 << 20))]
    memory_limit: u64,
    /// MiB of the file, its entities written out
    #[arg(long, value_name = "MIB", default_value_t = 16, value_parser = clap::value_parser!(u64).range(1..=1024))]
    max_file_size: u64,
    /// Nesting of elements
    #[arg(long, value_name = "N", default_value_t = 256, value_parser = clap::value_parser!(u32).range(1..=256))]
    max_depth: u32,
    /// Elements, references followed
    #[arg(long, value_name = "N", default_value_t = 100_000, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    max_elements: u32,
    /// Paths drawn
    #[arg(long, value_name = "N", default_value_t = 50_000, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    max_paths: u32,
    /// Curves and lines
    #[arg(long, value_name = "N", default_value_t = 200_000, value_parser = clap::value_parser!(u32).range(1..=10_000_000))]
    max_curves: u32,
    /// Pixels along a side of an embedded image
    #[arg(long, value_name = "PIXELS", default_value_t = 8192, value_parser = clap::value_parser!(u32).range(1..=16_384))]
    max_image_side: u32,
    /// Pixels of all embedded images together, millions
    #[arg(long, value_name = "MILLIONS", default_value_t = 64, value_parser = clap::value_parser!(u64).range(1..=1024))]
    max_image_pixels: u64,
}

impl LimitArgs {
    /// The longest that an item may take.
    pub fn time(&self) -> Duration {
        Duration::from_secs_f64(self.time_limit.min(1e9))
    }

    /// The most memory it may take, MiB.
    pub const fn memory(&self) -> u64 {
        self.memory_limit
    }

    /// What its drawing may hold.
    pub fn svg(&self) -> SvgLimits {
        SvgLimits {
            bytes: (self.max_file_size as usize) << 20,
            depth: self.max_depth as usize,
            elements: self.max_elements as usize,
            paths: self.max_paths as usize,
            curves: self.max_curves as usize,
            image_side: self.max_image_side,
            image_pixels: self.max_image_pixels * 1_000_000,
        }
    }
}
