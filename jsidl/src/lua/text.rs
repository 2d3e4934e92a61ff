//! Lua literals.

/// A string in quotes. Text beyond ASCII stays as it is: Wireshark reads UTF-8.
pub(super) fn quoted(text: &str) -> String {
    let mut out = String::with_capacity(text.len() + 2);
    out.push('"');
    for character in text.chars() {
        match character {
            '"' | '\\' => {
                out.push('\\');
                out.push(character);
            }
            // Three digits, so that a digit may follow.
            control if control.is_ascii_control() => {
                out.push_str(&format!("\\{:03}", control as u32));
            }
            other => out.push(other),
        }
    }
    out.push('"');
    out
}

/// Text for a comment.
pub(super) fn one_line(text: &str) -> String {
    text.replace(char::is_control, " ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quotes_and_controls_cannot_end_a_string() {
        assert_eq!(quoted("a\"b\\c\n1µ"), r#""a\"b\\c\0101µ""#);
    }
}
