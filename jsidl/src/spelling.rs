//! Suggestions for misspelt words.

/// Maximum length of a word that is compared: the work grows with the square of it.
const LONGEST: usize = 100;

/// Maximum number of mistakes in a word.
const MOST_MISTAKES: usize = 3;

/// The known word that differs least from a text; `None` if all differ too much.
pub(crate) fn nearest<'k>(text: &str, known: impl Iterator<Item = &'k str>) -> Option<&'k str> {
    if text.len() > LONGEST {
        return None;
    }
    // No mistake in a short word, more in a longer one.
    let most = (text.len() / 6).min(MOST_MISTAKES);
    let known = known.filter(|word| word.len().abs_diff(text.len()) <= most);
    let rated = known.map(|word| (distance(text, word), word));
    let best = rated.min_by_key(|(distance, _)| *distance);
    best.filter(|(distance, _)| *distance <= most)
        .map(|(_, word)| word)
}

/// Number of inserted, removed and replaced characters, ignoring letter case.
fn distance(one: &str, other: &str) -> usize {
    let other: Vec<_> = other.chars().collect();
    let mut row: Vec<usize> = (0..=other.len()).collect();
    for (line, a) in one.chars().enumerate() {
        let mut diagonal = std::mem::replace(&mut row[0], line + 1);
        for (column, b) in other.iter().enumerate() {
            let replaced = diagonal + usize::from(!a.eq_ignore_ascii_case(b));
            diagonal = row[column + 1];
            row[column + 1] = replaced.min(diagonal + 1).min(row[column] + 1);
        }
    }
    row.last().copied().unwrap_or_default()
}

/// The beginning of a text that is too long to be quoted.
pub(crate) fn shortened(text: &str) -> String {
    match text.char_indices().nth(40) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_word_is_suggested_unless_it_is_far() {
        let known = ["meter", "meter per second", "newton"];
        let near = |text| nearest(text, known.into_iter());
        assert_eq!(near("metre"), None);
        assert_eq!(near("meters"), Some("meter"));
        assert_eq!(near("meters per second"), Some("meter per second"));
        assert_eq!(near("Newton"), Some("newton"));
        assert_eq!(near("parsec"), None);
    }
}
