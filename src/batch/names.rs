//! Names of pictures: below the folder they are written to, each once, the same whatever part of the items is rendered.

use crate::digest::digest;
use std::collections::HashMap;
use std::path::{Component, Path};

/// Longest part of a name, bytes.
const LONGEST: usize = 100;
/// Digits of a digest that tell names apart.
const DIGITS: usize = 8;

/// The name of the picture of a file at the path `below` a folder that was given: that path without its ending, what file systems may
/// not like replaced by `_`.
pub fn of_file(below: &Path) -> String {
    let stem = below.with_extension("");
    let parts = stem.components().filter_map(|part| match part {
        Component::Normal(part) => Some(plain(&part.to_string_lossy())),
        _ => None,
    });
    let name = parts.collect::<Vec<_>>().join("/");
    if name.is_empty() { "_".into() } else { name }
}

/// A part of a name as every file system takes it.
pub fn plain(part: &str) -> String {
    const RESERVED: [&str; 4] = ["con", "prn", "aux", "nul"];
    let fine = |c: char| c.is_alphanumeric() || matches!(c, '-' | '_' | '.' | ' ' | '+' | '(' | ')' | '@' | ',');
    let text: String = part.chars().map(|c| if fine(c) { c } else { '_' }).collect();
    let mut text = text.trim_matches(' ').trim_end_matches('.').to_owned();
    let lower = text.to_lowercase();
    let device = lower.split('.').next().unwrap_or_default();
    let numbered = ["com", "lpt"].iter().any(|d| device.strip_prefix(d).is_some_and(|n| n.len() == 1));
    if text.is_empty() || text.starts_with('.') || RESERVED.contains(&device) || numbered {
        text.insert(0, '_');
    }
    if text.len() > LONGEST {
        let mark = digest(part.as_bytes());
        let mut end = LONGEST - DIGITS - 1;
        while !text.is_char_boundary(end) {
            end -= 1;
        }
        text.truncate(end);
        text = format!("{text}-{}", &mark[..DIGITS]);
    }
    text
}

/// A name that a list gives: relative, without `..`, in parts that are as they would be made.
///
/// # Errors
/// What is wrong with it.
pub fn given(name: &str) -> Result<String, &'static str> {
    if name.is_empty() {
        return Err("is empty");
    }
    if name.contains(['\\', ':']) || name.chars().any(char::is_control) {
        return Err("must not hold \\, : or control characters");
    }
    let mut parts = Vec::new();
    for part in name.split('/') {
        match part {
            "" if parts.is_empty() => return Err("must not be absolute"),
            "" | "." => return Err("must not have empty parts"),
            ".." => return Err("must not have a `..`: pictures lie in the folder of the batch"),
            part if plain(part) != part => return Err("is no name that every file system takes"),
            part => parts.push(part),
        }
    }
    Ok(parts.join("/"))
}

/// Makes every name differ from all others, upper and lower case alike: those that don't get digits of the digest of their file's path.
pub fn told_apart(names: &mut [String], paths: &[&Path]) {
    let key = |name: &str| name.to_lowercase();
    let mut count: HashMap<String, usize> = HashMap::new();
    names.iter().for_each(|name| *count.entry(key(name)).or_default() += 1);
    for (name, path) in names.iter_mut().zip(paths) {
        if count[&key(name)] > 1 {
            let mark = digest(path.to_string_lossy().as_bytes());
            *name = format!("{name}-{}", &mark[..DIGITS]);
        }
    }
    // The same file twice, or a file with the name that another was given.
    let mut taken: HashMap<String, usize> = HashMap::new();
    for name in names.iter_mut() {
        let mut number = 1;
        let mut unique = name.clone();
        while taken.contains_key(&key(&unique)) {
            number += 1;
            unique = format!("{name}-{number}");
        }
        *name = unique;
        taken.insert(key(name), number);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_stay_below_and_apart() {
        let name = |path: &str| of_file(Path::new(path));
        assert_eq!(name("a/b c.svg"), "a/b c");
        assert_eq!(name("../../etc/x.svg"), "etc/x");
        assert_eq!(name("nul.svg"), "_nul");
        assert_eq!(name(".svg"), "_.svg");
        assert_eq!(name("a?*<b.svg"), "a___b");
        assert!(name(&"x".repeat(300)).len() <= LONGEST);
        assert_ne!(name(&format!("{}a", "x".repeat(300))), name(&format!("{}b", "x".repeat(300))));
        for bad in ["", "/a", "../a", "a/../b", "a//b", "C:a", "a\\b", "a\n", ".a", "con", "a."] {
            assert!(given(bad).is_err(), "{bad:?}");
        }
        assert_eq!(given("a/b-1.2").unwrap(), "a/b-1.2");
        let mut names: Vec<String> = ["a", "b", "A", "b", "c"].map(Into::into).into();
        let paths = ["x/a", "x/b", "y/A", "x/b", "x/c"].map(Path::new);
        told_apart(&mut names, &paths);
        assert!(names[0].starts_with("a-") && names[2].starts_with("A-") && names[4] == "c", "{names:?}");
        assert_eq!(names[3], format!("{}-2", names[1]));
    }
}
