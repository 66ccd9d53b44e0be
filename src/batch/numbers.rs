//! Numbers of items, as `1-4,7`.

use core::fmt;
use core::str::FromStr;
use std::ops::RangeInclusive;

/// Which items, counted from 1.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Numbers(Vec<RangeInclusive<usize>>);

impl Numbers {
    /// Whether the item is one of them.
    pub fn holds(&self, number: usize) -> bool {
        self.0.iter().any(|range| range.contains(&number))
    }

    /// The largest that is named.
    pub fn largest(&self) -> usize {
        self.0.iter().filter(|r| *r.end() < usize::MAX).map(|r| *r.end()).max().unwrap_or(0)
    }
}

/// As it is read.
impl fmt::Display for Numbers {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, range) in self.0.iter().enumerate() {
            let comma = if index > 0 { "," } else { "" };
            match (range.start(), range.end()) {
                (from, &usize::MAX) => write!(f, "{comma}{from}-")?,
                (from, to) if from == to => write!(f, "{comma}{from}")?,
                (from, to) => write!(f, "{comma}{from}-{to}")?,
            }
        }
        Ok(())
    }
}

impl FromStr for Numbers {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let number = |text: &str| match text.trim().parse::<usize>() {
            Ok(number) if number > 0 && number < usize::MAX => Ok(number),
            _ => Err(format!("{text:?} is not a number from 1 on; items are given as 1-4,7,20-")),
        };
        let range = |part: &str| match part.split_once('-') {
            None => number(part).map(|n| n..=n),
            Some((from, "")) => Ok(number(from)?..=usize::MAX),
            Some((from, to)) => match (number(from)?, number(to)?) {
                (from, to) if from > to => Err(format!("{part:?} goes backwards")),
                (from, to) => Ok(from..=to),
            },
        };
        text.split(',').map(range).collect::<Result<_, _>>().map(Self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_read() {
        let numbers: Numbers = "1-4,7,20-".parse().unwrap();
        let held: Vec<_> = (1..23).filter(|&n| numbers.holds(n)).collect();
        assert_eq!(held, [1, 2, 3, 4, 7, 20, 21, 22]);
        assert_eq!(numbers.largest(), 7);
        assert_eq!(numbers.to_string(), "1-4,7,20-");
        assert_eq!(" 3 - 3, 05".parse::<Numbers>().unwrap().to_string(), "3,5");
        for bad in ["", "0", "a", "4-1", "1,", "-3", "1--2", "1.5"] {
            assert!(bad.parse::<Numbers>().is_err(), "{bad}");
        }
    }
}
