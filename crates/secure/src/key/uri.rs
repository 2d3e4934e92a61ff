//! URIs of keys in a token (RFC 7512), such as
//! `pkcs11:token=rover;object=node?module-path=/usr/lib/libtpm2_pkcs11.so&pin-source=/etc/jaus/pin`.

use std::collections::BTreeSet;
use std::path::PathBuf;

use super::TOKEN;

/// The part of a URI in which an attribute stands.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Part {
    Path,
    Query,
}

/// Where a key is, and how it is reached.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct TokenUri {
    /// What the token has to be called; any, if empty.
    pub(super) token: String,
    pub(super) serial: String,
    pub(super) model: String,
    pub(super) manufacturer: String,
    /// The label and the identifier of the key; one of them is there.
    pub(super) object: String,
    pub(super) id: Vec<u8>,
    /// The library that drives the token.
    pub(super) module: PathBuf,
    /// The file with the PIN.
    pub(super) pin: Option<PathBuf>,
}

impl TokenUri {
    pub(super) fn parse(text: &str) -> Result<Self, String> {
        let rest = text.get(TOKEN.len()..).unwrap_or_default();
        let (path, query) = rest.split_once('?').unwrap_or((rest, ""));
        let mut uri = Self::default();
        let path = path.split(';').map(|it| (it, Part::Path));
        let query = query.split('&').map(|it| (it, Part::Query));
        let mut known = BTreeSet::new();
        for (attribute, part) in path.chain(query).filter(|(it, _)| !it.is_empty()) {
            let pair = attribute.split_once('=').filter(|(_, it)| !it.is_empty());
            let (name, value) = pair.ok_or_else(|| format!("`{attribute}` has no value"))?;
            if !known.insert(name) {
                return Err(format!("`{name}` appears twice"));
            }
            uri.set(part, name, decoded(value)?)?;
        }
        if uri.object.is_empty() && uri.id.is_empty() {
            return Err("it names no key: add `object=LABEL` or `id=%01`".to_owned());
        }
        if uri.module.as_os_str().is_empty() {
            return Err("it names no library: add `?module-path=/usr/lib/…/….so`".to_owned());
        }
        Ok(uri)
    }

    fn set(&mut self, part: Part, name: &str, value: Vec<u8>) -> Result<(), String> {
        if (part, name) == (Part::Path, "id") {
            self.id = value;
            return Ok(());
        }
        let value = String::from_utf8(value).map_err(|_| format!("`{name}` is not UTF-8"))?;
        match (part, name) {
            (Part::Path, "token") => self.token = value,
            (Part::Path, "serial") => self.serial = value,
            (Part::Path, "model") => self.model = value,
            (Part::Path, "manufacturer") => self.manufacturer = value,
            (Part::Path, "object") => self.object = value,
            (Part::Path, "type") if value == "private" => {}
            (Part::Query, "module-path") => self.module = value.into(),
            (Part::Query, "pin-source") => self.pin = Some(pin_file(value)?),
            (_, "pin-value") => {
                return Err("a PIN in it would be seen by other users: use pin-source".to_owned());
            }
            _ => return Err(format!("`{name}={value}` is not supported here")),
        }
        Ok(())
    }
}

/// The file that `pin-source` names: by its path, or by a `file` URI (RFC 8089), whose own escapes are
/// inside those of the attribute.
fn pin_file(source: String) -> Result<PathBuf, String> {
    if source.starts_with('|') {
        return Err("`pin-source` runs no program: write the PIN to a file".to_owned());
    }
    let Some(rest) = source.strip_prefix("file:") else {
        return Ok(source.into());
    };
    let path = match rest.strip_prefix("//") {
        Some(rest) => rest.strip_prefix("localhost").unwrap_or(rest),
        None => rest,
    };
    if !path.starts_with('/') {
        return Err(format!("`pin-source={source}` names no file of this host"));
    }
    let path = String::from_utf8(decoded(path)?);
    path.map(PathBuf::from)
        .map_err(|_| "`pin-source` is not UTF-8".to_owned())
}

/// Octets, some of which are written as `%2F`.
fn decoded(text: &str) -> Result<Vec<u8>, String> {
    let mut parts = text.split('%');
    let mut octets = parts.next().unwrap_or_default().as_bytes().to_vec();
    for part in parts {
        let digits = part.get(..2);
        let octet = digits
            .filter(|it| it.bytes().all(|it| it.is_ascii_hexdigit()))
            .and_then(|it| u8::from_str_radix(it, 16).ok())
            .ok_or_else(|| format!("`%` in `{text}` needs two hexadecimal digits"))?;
        octets.push(octet);
        octets.extend_from_slice(&part.as_bytes()[2..]);
    }
    Ok(octets)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_uri_names_token_key_library_and_pin() {
        let text = "PKCS11:token=my%20token;serial=7;model=M;manufacturer=Maker;object=node;id=%01%fF;type=private\
                    ?module-path=/usr/lib/x.so&pin-source=file:///etc/jaus/my%2520pin";
        let expected = TokenUri {
            token: "my token".to_owned(),
            serial: "7".to_owned(),
            model: "M".to_owned(),
            manufacturer: "Maker".to_owned(),
            object: "node".to_owned(),
            id: vec![1, 255],
            module: "/usr/lib/x.so".into(),
            pin: Some("/etc/jaus/my pin".into()),
        };
        assert_eq!(TokenUri::parse(text), Ok(expected));
    }

    #[test]
    fn the_file_of_a_pin_is_named_by_path_or_uri() {
        for source in [
            "/etc/pin",
            "file:/etc/pin",
            "file:///etc/pin",
            "file://localhost/etc/pin",
        ] {
            let text = format!("pkcs11:object=a?module-path=/x.so&pin-source={source}");
            let pin = TokenUri::parse(&text).unwrap().pin;
            assert_eq!(pin, Some("/etc/pin".into()), "{source}");
        }
    }

    #[test]
    fn what_a_uri_lacks_or_must_not_have_is_named() {
        for (text, why) in [
            ("pkcs11:token=a?module-path=/x.so", "object=LABEL"),
            ("pkcs11:object=a", "module-path"),
            (
                "pkcs11:object=a?module-path=/x.so&pin-value=1",
                "pin-source",
            ),
            ("pkcs11:object=a;slot-id=3?module-path=/x.so", "slot-id=3"),
            ("pkcs11:object=a%2?module-path=/x.so", "hexadecimal"),
            ("pkcs11:object=%é1?module-path=/x.so", "hexadecimal"),
            ("pkcs11:object=%ff?module-path=/x.so", "UTF-8"),
            ("pkcs11:object=%+1?module-path=/x.so", "hexadecimal"),
            ("pkcs11:object", "no value"),
            ("pkcs11:object=?module-path=/x.so", "no value"),
            ("pkcs11:object=a;object=b?module-path=/x.so", "twice"),
            ("pkcs11:object=a;module-path=/x.so", "module-path=/x.so"),
            ("pkcs11:token=t?module-path=/x.so&object=a", "object=a"),
            (
                "pkcs11:object=a?module-path=/x.so&pin-source=%7Cecho%201",
                "no program",
            ),
            (
                "pkcs11:object=a?module-path=/x.so&pin-source=file://host/pin",
                "of this host",
            ),
            ("pkcs11:", "object=LABEL"),
        ] {
            let error = TokenUri::parse(text).unwrap_err();
            assert!(error.contains(why), "{text}: {error}");
        }
    }
}
