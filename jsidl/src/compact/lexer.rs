//! Splits a text in the compact form into tokens.

/// Maximum size of a text in octets; the largest published one has less than a tenth of it.
pub(super) const LARGEST: usize = 2 << 20;

/// Kind of a token.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Word,
    Number,
    /// In quotes.
    Text,
    /// Between `##` and `##`.
    Interpretation,
    /// An element as XML in `/*@ … */`.
    Xml,
    Sign,
    End,
}

/// A token: its kind and its octets in the text.
#[derive(Debug, Clone, Copy)]
pub(super) struct Token {
    pub(super) kind: Kind,
    pub(super) at: u32,
    pub(super) end: u32,
}

/// A comment before a token.
#[derive(Debug, Clone, Copy)]
pub(super) struct Remark {
    /// Index of the token that follows.
    pub(super) token: usize,
    pub(super) at: u32,
    /// Without the signs that enclose it.
    pub(super) start: u32,
    pub(super) end: u32,
    /// `//@ …`, which changes what the following construct says.
    pub(super) is_amendment: bool,
}

/// A mistake with its position.
#[derive(Debug)]
pub(crate) struct Fault {
    pub(super) at: usize,
    pub(super) message: String,
}

impl Fault {
    pub(super) fn new(at: usize, message: impl Into<String>) -> Self {
        Self {
            at,
            message: message.into(),
        }
    }
}

/// Signs of two characters.
const PAIRS: [&str; 8] = ["->", "==", "!=", "&&", "||", "<=", ">=", "##"];

/// All tokens, the last one [`Kind::End`], and the comments between them.
pub(super) fn tokens(text: &str) -> Result<(Vec<Token>, Vec<Remark>), Fault> {
    if text.len() > LARGEST {
        let message = format!("the text is larger than {} MiB: split it", LARGEST >> 20);
        return Err(Fault::new(0, message));
    }
    let mut lexer = Lexer {
        text,
        at: 0,
        tokens: Vec::new(),
        remarks: Vec::new(),
    };
    lexer.run()?;
    Ok((lexer.tokens, lexer.remarks))
}

struct Lexer<'t> {
    text: &'t str,
    at: usize,
    tokens: Vec<Token>,
    remarks: Vec<Remark>,
}

fn offset(at: usize) -> u32 {
    u32::try_from(at).unwrap_or(u32::MAX)
}

impl<'t> Lexer<'t> {
    fn rest(&self) -> &'t str {
        &self.text[self.at..]
    }

    fn run(&mut self) -> Result<(), Fault> {
        while let Some(next) = self.rest().chars().next() {
            let rest = self.rest();
            if next.is_whitespace() {
                self.at += next.len_utf8();
            } else if rest.starts_with("//") {
                self.line_comment();
            } else if rest.starts_with("/*@") {
                let length = self.through("*/", 3, "`/*@`")?;
                self.token(Kind::Xml, length);
            } else if rest.starts_with("/*") {
                let length = self.through("*/", 2, "`/*`")?;
                self.remark(2, length - 2, length, false);
            } else if rest.starts_with("##") {
                let length = self.through("##", 2, "an interpretation")?;
                self.token(Kind::Interpretation, length);
            } else if next == '"' || next == '\'' {
                self.quoted(next)?;
            } else if next.is_ascii_alphabetic() || next == '_' {
                let word = |c: char| c.is_ascii_alphanumeric() || c == '_';
                self.token(Kind::Word, rest.find(|c| !word(c)).unwrap_or(rest.len()));
            } else if next.is_ascii_digit()
                || next == '.' && rest[1..].starts_with(|c: char| c.is_ascii_digit())
            {
                self.token(Kind::Number, number(rest));
            } else {
                let pair = PAIRS.iter().any(|it| rest.starts_with(it));
                self.token(Kind::Sign, if pair { 2 } else { next.len_utf8() });
            }
        }
        self.token(Kind::End, 0);
        Ok(())
    }

    fn token(&mut self, kind: Kind, length: usize) {
        self.tokens.push(Token {
            kind,
            at: offset(self.at),
            end: offset(self.at + length),
        });
        self.at += length;
    }

    fn remark(&mut self, from: usize, to: usize, length: usize, is_amendment: bool) {
        self.remarks.push(Remark {
            token: self.tokens.len(),
            at: offset(self.at),
            start: offset(self.at + from),
            end: offset(self.at + to),
            is_amendment,
        });
        self.at += length;
    }

    fn line_comment(&mut self) {
        let rest = self.rest();
        let length = rest.find(['\n', '\r']).unwrap_or(rest.len());
        let is_amendment = rest.starts_with("//@");
        self.remark(
            if is_amendment { 3 } else { 2 },
            length,
            length,
            is_amendment,
        );
    }

    /// Length up to and including `end`, which is searched after `skip` octets.
    fn through(&self, end: &str, skip: usize, what: &str) -> Result<usize, Fault> {
        let rest = self.rest();
        let found = rest[skip..].find(end).map(|it| it + skip + end.len());
        found.ok_or_else(|| Fault::new(self.at, format!("{what} is not closed: add `{end}`")))
    }

    fn quoted(&mut self, quote: char) -> Result<(), Fault> {
        let mut characters = self.rest().char_indices().skip(1);
        while let Some((at, character)) = characters.next() {
            if character == '\\' {
                characters.next();
            } else if character == quote {
                self.token(Kind::Text, at + 1);
                return Ok(());
            }
        }
        Err(Fault::new(
            self.at,
            format!("a text is not closed: add `{quote}`"),
        ))
    }
}

/// Length of a number, such as `1`, `.5`, `1.0`, `1.0.2`, `2.5e-3` and `0x4B00`.
fn number(rest: &str) -> usize {
    let octets = rest.as_bytes();
    if rest.starts_with("0x") || rest.starts_with("0X") {
        let digits = octets[2..].iter().take_while(|it| it.is_ascii_hexdigit());
        return 2 + digits.count();
    }
    let plain = |it: &&u8| it.is_ascii_digit() || **it == b'.';
    let mut length = octets.iter().take_while(plain).count();
    if octets
        .get(length)
        .is_some_and(|it| it.eq_ignore_ascii_case(&b'e'))
    {
        let sign = usize::from(
            octets
                .get(length + 1)
                .is_some_and(|it| matches!(it, b'+' | b'-')),
        );
        let digits = octets[length + 1 + sign..]
            .iter()
            .take_while(|it| it.is_ascii_digit());
        let digits = digits.count();
        if digits > 0 {
            length += 1 + sign + digits;
        }
    }
    length
}

/// The text that a token in quotes stands for.
pub(super) fn unquoted(token: &str) -> String {
    let inner = token
        .get(1..token.len().saturating_sub(1))
        .unwrap_or_default();
    let mut text = String::with_capacity(inner.len());
    let mut characters = inner.chars().peekable();
    while let Some(character) = characters.next() {
        if character != '\\' {
            text.push(character);
            continue;
        }
        match characters.next() {
            Some('n') => text.push('\n'),
            Some('t') => text.push('\t'),
            Some('r') => text.push('\r'),
            Some('b' | 'f') | None => text.push(' '),
            Some(digit) if digit.is_digit(8) => {
                let mut code = digit.to_digit(8).unwrap_or(0);
                let most = if code < 4 { 2 } else { 1 };
                for _ in 0..most {
                    let Some(next) = characters.peek().and_then(|it| it.to_digit(8)) else {
                        break;
                    };
                    code = code * 8 + next;
                    characters.next();
                }
                text.push(char::from_u32(code).unwrap_or(' '));
            }
            Some(other) => text.push(other),
        }
    }
    text
}

/// A text in quotes, on as many lines as it has.
pub(super) fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\""))
}
