//! Words for a POSIX shell.

use super::FarmError;

/// Words on one line, each read back by a POSIX shell as it is.
///
/// # Errors
/// A word with control characters: schedulers cut lines at them.
pub fn line(words: &[String]) -> Result<String, FarmError> {
    let quoted: Vec<String> = words.iter().map(|word| quoted(word)).collect::<Result<_, _>>()?;
    Ok(quoted.join(" "))
}

/// A word, in single quotes unless it needs none.
///
/// # Errors
/// As [`line`].
pub fn quoted(word: &str) -> Result<String, FarmError> {
    check(word)?;
    let is_plain = |b: u8| b.is_ascii_alphanumeric() || b"-_./,:=+@%".contains(&b);
    // A word with = in front would be an assignment, one with : or @ or % is none of a shell's.
    if !word.is_empty() && word.bytes().all(is_plain) {
        return Ok(word.into());
    }
    Ok(format!("'{}'", word.replace('\'', r"'\''")))
}

/// Refuses control characters.
///
/// # Errors
/// There is one.
pub fn check(word: &str) -> Result<(), FarmError> {
    if word.chars().any(char::is_control) {
        let reason = "holds a control character, such as the end of a line: that cannot be a word of a job";
        return Err(FarmError::Word { word: word.into(), reason });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_quoted_and_lines_cannot_be_broken() {
        let words = ["a", "-o=x", "", "a b", "it's", "$(x)", "`x`", "a\\", "*", "ä", "~", "#"].map(String::from);
        assert_eq!(line(&words).unwrap(), r"a -o=x '' 'a b' 'it'\''s' '$(x)' '`x`' 'a\' '*' 'ä' '~' '#'");
        for bad in ["a\nb", "\r", "\0", "\u{85}"] {
            assert!(matches!(quoted(bad), Err(FarmError::Word { word, .. }) if word == bad));
        }
    }
}
