//! File names of the frames of a sequence.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// Digits of a frame's number where the name does not say.
const DIGITS: usize = 4;

/// The file of a frame: its number takes the place of the last run of `#` in the file name, as many digits at least; of a name
/// without, it stands with four digits before the ending. `a.png` is `a.0007.png`, `a-###.png` is `a-007.png`.
pub fn frame_path(path: &Path, number: u32) -> PathBuf {
    let name = path.file_name().and_then(|name| name.to_str());
    if let Some((name, end)) = name.and_then(|name| Some((name, name.rfind('#')? + 1))) {
        let start = name[..end].trim_end_matches('#').len();
        let digits = end - start;
        return path.with_file_name(format!("{}{number:0digits$}{}", &name[..start], &name[end..]));
    }
    let mut name = OsString::from(path.file_stem().unwrap_or_default());
    name.push(format!(".{number:0DIGITS$}"));
    if let Some(ending) = path.extension() {
        name.push(".");
        name.push(ending);
    }
    path.with_file_name(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_have_their_numbers_in_their_names() {
        let cases = [
            ("a/b.png", 7, "a/b.0007.png"),
            ("a/b.c.exr", 12345, "a/b.c.12345.exr"),
            ("a#/b-##.png", 7, "a#/b-07.png"),
            ("#x###y.png", 1000, "#x1000y.png"),
            ("营业-####.exr", 1, "营业-0001.exr"),
        ];
        for (path, number, wanted) in cases {
            assert_eq!(frame_path(Path::new(path), number), Path::new(wanted));
        }
    }
}
