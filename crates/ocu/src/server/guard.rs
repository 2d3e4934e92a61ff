//! Protection against cross-site requests and DNS rebinding, by checking the headers Origin and
//! Host.

use std::net::{IpAddr, Ipv6Addr};

use axum::http::{HeaderMap, StatusCode, header};

/// Why a request is rejected.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub(super) enum Refusal {
    #[error("a request needs exactly one Host header")]
    NoHost,
    #[error(
        "unknown host name {0:?}: use the address or localhost, or start jaus-ocu with --host for \
         this name"
    )]
    UnknownHost(String),
    #[error("requests from other sites' pages are refused")]
    OtherSite,
}

impl Refusal {
    pub(super) const fn status(&self) -> StatusCode {
        match self {
            Self::NoHost => StatusCode::BAD_REQUEST,
            Self::UnknownHost(_) => StatusCode::MISDIRECTED_REQUEST,
            Self::OtherSite => StatusCode::FORBIDDEN,
        }
    }
}

/// Accepts requests from the own page, from a typed URL, and from programs other than browsers.
pub(super) fn check(headers: &HeaderMap, hosts: &[String]) -> Result<(), Refusal> {
    let host = host(headers).ok_or(Refusal::NoHost)?;
    let (name, _) = name_and_port(host);
    if !is_ours(name, hosts) {
        return Err(Refusal::UnknownHost(name.chars().take(80).collect()));
    }
    if headers.contains_key(header::ORIGIN) {
        let origin = sole(headers, &header::ORIGIN).and_then(|origin| {
            let http = origin.strip_prefix("http://");
            http.or_else(|| origin.strip_prefix("https://"))
        });
        if !origin.is_some_and(|it| it.eq_ignore_ascii_case(host)) {
            return Err(Refusal::OtherSite);
        }
    }
    let site = sole(headers, "sec-fetch-site").unwrap_or("none");
    let follows_link = sole(headers, "sec-fetch-mode") == Some("navigate");
    if matches!(site, "same-origin" | "none") || follows_link {
        Ok(())
    } else {
        Err(Refusal::OtherSite)
    }
}

/// The host of a request.
pub(super) fn host(headers: &HeaderMap) -> Option<&str> {
    sole(headers, &header::HOST)
}

/// The value of a header that occurs exactly once.
fn sole(headers: &HeaderMap, name: impl header::AsHeaderName) -> Option<&str> {
    let mut values = headers.get_all(name).iter();
    let value = values.next()?;
    values.next().is_none().then_some(value)?.to_str().ok()
}

/// The name of a host, and the port that it names.
pub(super) fn name_and_port(host: &str) -> (&str, Option<u16>) {
    match host.rsplit_once(':') {
        Some((name, port)) if port.bytes().all(|it| it.is_ascii_digit()) => {
            (name, port.parse().ok())
        }
        _ => (host, None),
    }
}

/// Whether the host is ours. Literal addresses are safe from DNS rebinding; other names must be
/// configured.
fn is_ours(name: &str, hosts: &[String]) -> bool {
    let inner = name.strip_prefix('[').and_then(|it| it.strip_suffix(']'));
    let is_address = name.parse::<IpAddr>().is_ok_and(|it| it.is_ipv4())
        || inner.is_some_and(|it| it.parse::<Ipv6Addr>().is_ok());
    is_address || name.eq_ignore_ascii_case("localhost") || is_given(name, hosts)
}

/// Whether the name was given.
pub(super) fn is_given(name: &str, hosts: &[String]) -> bool {
    hosts.iter().any(|host| name.eq_ignore_ascii_case(host))
}

#[cfg(test)]
mod tests {
    use axum::http::HeaderValue;

    use super::*;

    fn checked(pairs: &[(&'static str, &'static str)]) -> Result<(), Refusal> {
        let mut headers = HeaderMap::new();
        for (name, value) in pairs {
            headers.append(*name, HeaderValue::from_static(value));
        }
        check(&headers, &["rover.local".to_owned()])
    }

    #[test]
    fn our_own_page_comes_in_under_all_its_names() {
        for host in [
            "127.0.0.1:8080",
            "192.168.1.7",
            "[::1]:8080",
            "localhost:8080",
            "LOCALHOST",
            "rover.local:8080",
        ] {
            assert_eq!(checked(&[("host", host)]), Ok(()), "{host}");
        }
        let own = [
            ("host", "127.0.0.1:8080"),
            ("origin", "http://127.0.0.1:8080"),
            ("sec-fetch-site", "same-origin"),
        ];
        assert_eq!(checked(&own), Ok(()));
    }

    #[test]
    fn a_name_that_somebody_else_points_at_us_is_not_ours() {
        for host in [
            "evil.example",
            "evil.example:8080",
            "127.0.0.1.evil.example",
            "",
            "::1",
        ] {
            let refused = checked(&[("host", host), ("origin", "http://evil.example")]);
            assert!(matches!(refused, Err(Refusal::UnknownHost(_))), "{host}");
        }
        assert_eq!(checked(&[]), Err(Refusal::NoHost));
        let two = [("host", "localhost"), ("host", "evil.example")];
        assert_eq!(checked(&two), Err(Refusal::NoHost));
    }

    #[test]
    fn pages_of_other_sites_stay_out_also_those_at_another_port() {
        for origin in [
            "http://evil.example",
            "http://127.0.0.1:9999",
            "http://127.0.0.1:8080.evil.example",
            "null",
            "",
        ] {
            let refused = checked(&[("host", "127.0.0.1:8080"), ("origin", origin)]);
            assert_eq!(refused, Err(Refusal::OtherSite), "{origin}");
        }
        for site in ["cross-site", "same-site"] {
            let image = [("host", "localhost"), ("sec-fetch-site", site)];
            assert_eq!(checked(&image), Err(Refusal::OtherSite), "{site}");
        }
    }

    #[test]
    fn a_link_on_another_site_leads_to_the_page() {
        let link = [
            ("host", "localhost"),
            ("sec-fetch-site", "cross-site"),
            ("sec-fetch-mode", "navigate"),
        ];
        assert_eq!(checked(&link), Ok(()));
    }
}
