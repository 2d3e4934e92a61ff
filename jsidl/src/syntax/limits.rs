//! Rejects excessive texts before XML parsing: the parser's work grows with the square of a tag's
//! attributes and of the nesting.

/// Maximum size of a text; the largest published definition has less than a tenth of it.
pub(crate) const LARGEST: u64 = 8 << 20;

/// Maximum nesting of elements; published definitions need 15.
const DEEPEST: usize = 100;

/// Maximum number of attributes of a tag; the language has at most seven.
const MOST_ATTRIBUTES: usize = 50;

/// Maximum number of namespace declarations in a text: the parser compares those of an element with
/// all in scope. Published files have at most 20.
const MOST_NAMESPACES: usize = 2_000;

/// The position of the first excess in a text, with the remedy.
pub(crate) fn excess(text: &str) -> Option<(usize, String)> {
    if text.len() as u64 > LARGEST {
        let message = format!("the text is larger than {} MiB: split it", LARGEST >> 20);
        return Some((0, message));
    }
    if let Some((at, _)) = text.match_indices("xmlns").nth(MOST_NAMESPACES) {
        let message = format!(
            "there are more than {MOST_NAMESPACES} namespace declarations: put them at the root"
        );
        return Some((at, message));
    }
    let mut depth = 0_usize;
    let mut at = 0;
    while let Some(found) = text[at..].find('<') {
        let start = at + found;
        let rest = &text[start..];
        if let Some(length) = skipped(rest) {
            at = start + length;
            continue;
        }
        let tag = Tag::scan(rest);
        if tag.attributes > MOST_ATTRIBUTES {
            let message = format!(
                "the element has more than {MOST_ATTRIBUTES} attributes: JSIDL allows at most seven"
            );
            return Some((start, message));
        }
        match tag.kind {
            TagKind::Start => depth += 1,
            TagKind::End => depth = depth.saturating_sub(1),
            TagKind::Empty => {}
        }
        if depth > DEEPEST {
            let message = format!("elements are nested more than {DEEPEST} deep: flatten them");
            return Some((start, message));
        }
        at = start + tag.length;
    }
    None
}

/// Length of a comment, a CDATA section or a processing instruction.
fn skipped(rest: &str) -> Option<usize> {
    [("<!--", "-->"), ("<![CDATA[", "]]>"), ("<?", "?>")]
        .into_iter()
        .find(|(open, _)| rest.starts_with(open))
        .map(|(_, close)| rest.find(close).map_or(rest.len(), |at| at + close.len()))
}

enum TagKind {
    Start,
    End,
    Empty,
}

struct Tag {
    kind: TagKind,
    length: usize,
    attributes: usize,
}

impl Tag {
    fn scan(rest: &str) -> Self {
        let octets = rest.as_bytes();
        let mut quote = None;
        let mut attributes = 0;
        for (at, &octet) in octets.iter().enumerate().skip(1) {
            match (quote, octet) {
                (None, b'"' | b'\'') => {
                    quote = Some(octet);
                    attributes += 1;
                }
                (None, b'>') => {
                    let kind = match (octets[1], octets[at - 1]) {
                        (b'/', _) => TagKind::End,
                        (_, b'/') => TagKind::Empty,
                        _ => TagKind::Start,
                    };
                    return Self {
                        kind,
                        length: at + 1,
                        attributes,
                    };
                }
                (Some(open), _) if open == octet => quote = None,
                _ => {}
            }
        }
        Self {
            kind: TagKind::Start,
            length: octets.len(),
            attributes,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_ordinary_text_passes() {
        let text = "<?xml?><!-- <a> --><a b='>' c=\"<\"><d/><![CDATA[<e>]]></a>".repeat(200);
        assert_eq!(excess(&text), None);
    }

    #[test]
    fn deep_nesting_and_long_tags_are_found_where_they_begin() {
        let (at, message) = excess(&"<a>".repeat(1000)).expect("too deep");
        assert_eq!(at, 300);
        assert!(message.contains("nested"));
        let tag = format!("<a {}/>", "b='' ".repeat(51));
        assert_eq!(excess(&tag).map(|(at, _)| at), Some(0));
        assert!(excess(&"<".repeat(50)).is_none());
    }
}
