//! URIs of keys in a token (RFC 7512), such as
//! `pkcs11:token=rover;object=node?module-path=/usr/lib/libtpm2_pkcs11.so&pin-source=/etc/jaus/pin`.

use std::path::PathBuf;

use super::TOKEN;

/// Where a key is, and how it is reached.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct TokenUri {
    /// What the token has to be called; any, if empty.
    pub(super) token: String,
    pub(super) serial: String,
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
        let rest = text.strip_prefix(TOKEN).unwrap_or(text);
        let (path, query) = rest.split_once('?').unwrap_or((rest, ""));
        let mut uri = Self::default();
        let attributes = path.split(';').chain(query.split('&'));
        for attribute in attributes.filter(|it| !it.is_empty()) {
            let (name, value) = attribute
                .split_once('=')
                .ok_or_else(|| format!("`{attribute}` has no value"))?;
            uri.set(name, decoded(value)?)?;
        }
        if uri.object.is_empty() && uri.id.is_empty() {
            return Err("it names no key: add `object=LABEL` or `id=%01`".to_owned());
        }
        if uri.module.as_os_str().is_empty() {
            return Err("it names no library: add `?module-path=/usr/lib/…/….so`".to_owned());
        }
        Ok(uri)
    }

    fn set(&mut self, name: &str, value: Vec<u8>) -> Result<(), String> {
        if name == "id" {
            self.id = value;
            return Ok(());
        }
        let value = String::from_utf8(value).map_err(|_| format!("`{name}` is not UTF-8"))?;
        match name {
            "token" => self.token = value,
            "serial" => self.serial = value,
            "object" => self.object = value,
            "type" if value == "private" => {}
            "module-path" => self.module = value.into(),
            "pin-source" => {
                let file = value.strip_prefix("file:").unwrap_or(&value);
                self.pin = Some(file.strip_prefix("//").unwrap_or(file).into());
            }
            "pin-value" => {
                return Err("a PIN in it would be seen by other users: use pin-source".to_owned());
            }
            _ => return Err(format!("`{name}={value}` is not supported")),
        }
        Ok(())
    }
}

/// Octets, some of which are written as `%2F`.
fn decoded(text: &str) -> Result<Vec<u8>, String> {
    let mut parts = text.split('%');
    let mut octets = parts.next().unwrap_or_default().as_bytes().to_vec();
    for part in parts {
        let octet = part
            .get(..2)
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
        let text = "pkcs11:token=my%20token;serial=7;object=node;id=%01%fF;type=private\
                    ?module-path=/usr/lib/x.so&pin-source=file:///etc/jaus/pin";
        let expected = TokenUri {
            token: "my token".to_owned(),
            serial: "7".to_owned(),
            object: "node".to_owned(),
            id: vec![1, 255],
            module: "/usr/lib/x.so".into(),
            pin: Some("/etc/jaus/pin".into()),
        };
        assert_eq!(TokenUri::parse(text), Ok(expected));
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
            ("pkcs11:object", "no value"),
            ("pkcs11:", "object=LABEL"),
        ] {
            let error = TokenUri::parse(text).unwrap_err();
            assert!(error.contains(why), "{text}: {error}");
        }
    }
}
