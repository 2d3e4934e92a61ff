//! Authorities in folders, at a fixed time.

use rustls::pki_types::UnixTime;
use rustls::pki_types::pem::PemObject as _;
use tempfile::TempDir;

use std::fs;

use super::*;
use crate::approval::DualControl;
use crate::authority::{Authority, Rejection};
use crate::credentials::{CertificateFiles, Credentials};
use crate::trust::TrustFile;

const NOW: u64 = 1_800_000_000;
const DAY: u64 = 24 * 60 * 60;

fn at(seconds: u64) -> SystemTime {
    SystemTime::UNIX_EPOCH + Duration::from_secs(seconds)
}

fn unix(seconds: u64) -> UnixTime {
    UnixTime::since_unix_epoch(Duration::from_secs(seconds))
}

fn authority() -> (TempDir, CertificateAuthority) {
    let folder = tempfile::tempdir().unwrap();
    let authority = CertificateAuthority::create(folder.path(), "team", None, at(NOW)).unwrap();
    (folder, authority)
}

fn request(name: &str, ids: &[&str]) -> Request {
    Request {
        name: name.to_owned(),
        key: PublicKey::from_octets([7; 32]),
        ids: ids.iter().map(|it| it.parse().unwrap()).collect(),
        life: Duration::from_secs(30 * DAY),
    }
}

fn issue(authority: &CertificateAuthority, name: &str) -> CertificateDer<'static> {
    let issued = authority.issue(&request(name, &["101.255.255"]), at(NOW));
    CertificateDer::from_pem_slice(issued.unwrap().as_bytes()).unwrap()
}

fn at_node(folder: &TempDir) -> Authority {
    let [certificate, list] = ["ca.crt", "ca.crl"].map(|it| folder.path().join(it));
    Authority::load(&certificate, Some(&list)).unwrap()
}

#[test]
fn a_node_accepts_what_its_authority_has_issued_while_it_is_valid() {
    let (folder, authority) = authority();
    let request = request("rover", &["101.255.255", "102.1.33"]);
    let pem = authority.issue(&request, at(NOW)).unwrap();
    let der = CertificateDer::from_pem_slice(pem.as_bytes()).unwrap();
    let node = at_node(&folder);
    let certificate = node.verify(&der, unix(NOW)).unwrap();
    assert_eq!(certificate.name(), "rover");
    assert_eq!(
        (certificate.key(), certificate.ids()),
        (request.key, &*request.ids)
    );
    assert!(!certificate.expires_soon(unix(NOW)));
    assert!(certificate.expires_soon(unix(NOW + 21 * DAY)));

    let late = node.verify(&der, unix(NOW + 365 * DAY)).unwrap_err();
    assert!(matches!(late, Rejection::Expired { .. }), "{late}");
    let text = late.to_string();
    assert!(
        text.contains("2027-02-14") && text.contains("2028-01-15"),
        "both times: {text}"
    );
    let early = node.verify(&der, unix(NOW - 365 * DAY)).unwrap_err();
    assert!(matches!(early, Rejection::NotYetValid { .. }), "{early}");
    assert!(early.to_string().contains("set the clock"), "{early}");
}

#[test]
fn a_revoked_certificate_is_refused_and_another_of_the_name_is_not() {
    let (folder, authority) = authority();
    let (first, second) = (issue(&authority, "rover"), issue(&authority, "rover"));
    let serial = Certificate::from_der(&first).unwrap().serial().to_owned();
    assert_eq!(authority.revoke(&serial, at(NOW)).unwrap().len(), 1);
    assert_eq!(authority.revoke(&serial, at(NOW)).unwrap(), [], "already");
    let node = at_node(&folder);
    let refused = node.verify(&first, unix(NOW)).unwrap_err();
    assert!(matches!(refused, Rejection::Revoked { .. }), "{refused}");
    assert!(node.verify(&second, unix(NOW)).is_ok());

    assert_eq!(authority.revoke("rover", at(NOW)).unwrap().len(), 1);
    assert!(at_node(&folder).verify(&second, unix(NOW)).is_err());
    let issued = CertificateAuthority::issued(folder.path()).unwrap();
    assert!(
        issued.iter().all(|it| it.revoked == Some(at(NOW))),
        "{issued:?}"
    );
}

#[test]
fn another_authority_is_refused_and_so_is_its_revocation_list() {
    let ((folder, authority), (other_folder, other)) = (authority(), authority_named("team"));
    let foreign = issue(&other, "rover");
    let refused = at_node(&folder).verify(&foreign, unix(NOW)).unwrap_err();
    assert!(matches!(refused, Rejection::OtherAuthority(_)), "{refused}");

    let (own, list) = (
        folder.path().join("ca.crt"),
        other_folder.path().join("ca.crl"),
    );
    let mixed = Authority::load(&own, Some(&list)).unwrap();
    assert!(
        mixed
            .verify(&issue(&authority, "rover"), unix(NOW))
            .is_err()
    );
}

fn authority_named(name: &str) -> (TempDir, CertificateAuthority) {
    let folder = tempfile::tempdir().unwrap();
    let authority = CertificateAuthority::create(folder.path(), name, None, at(NOW)).unwrap();
    (folder, authority)
}

#[test]
fn damaged_certificates_are_refused() {
    let (folder, authority) = authority();
    let node = at_node(&folder);
    let der = issue(&authority, "rover");
    for length in 0..der.len() {
        let cut = CertificateDer::from(&der[..length]);
        assert!(node.verify(&cut, unix(NOW)).is_err(), "{length}");
    }
    for position in 0..der.len() {
        let mut damaged = der.to_vec();
        damaged[position] ^= 1;
        let verified = node.verify(&damaged.into(), unix(NOW));
        assert!(verified.is_err(), "{position}");
    }
}

#[test]
fn a_certificate_needs_ids_that_are_well_formed() {
    let (folder, authority) = authority();
    let node = at_node(&folder);
    for (names, words) in [
        (vec![], "it has no ids"),
        (vec!["http://rover"], "it has no ids"),
        (vec!["jaus:101.1"], "`101.1` in it is not an id"),
        (vec!["jaus:1.1.1"; MOST_IDS + 1], "more than 32 ids"),
    ] {
        let mut params = CertificateParams::default();
        params.distinguished_name = named("rover");
        let name = |it: &str| SanType::URI(it.to_owned().try_into().unwrap());
        params.subject_alt_names = names.iter().copied().map(name).collect();
        params.not_before = time(at(NOW));
        params.not_after = time(at(NOW + DAY));
        let key = PublicKey::from_octets([7; 32]);
        let issued = params.signed_by(&key, &authority.issuer()).unwrap();
        let refused = node
            .verify(issued.der(), unix(NOW))
            .unwrap_err()
            .to_string();
        assert!(refused.contains(words), "{refused}");
    }
}

#[test]
fn a_request_out_of_range_is_refused() {
    let (_folder, authority) = authority();
    let many = vec!["101.1.1"; MOST_IDS + 1];
    for bad in [
        request("", &["101.1.1"]),
        request("two words", &["101.1.1"]),
        request("a#b", &["101.1.1"]),
        request("\u{1b}]0;x", &["101.1.1"]),
        request(&"x".repeat(65), &["101.1.1"]),
        request("rover", &[]),
        request("rover", &many),
        Request {
            life: Duration::ZERO,
            ..request("rover", &["101.1.1"])
        },
        Request {
            life: Duration::MAX,
            ..request("rover", &["101.1.1"])
        },
    ] {
        assert!(authority.issue(&bad, at(NOW)).is_err(), "{bad:?}");
    }
    assert_eq!(CertificateAuthority::issued(&authority.folder).unwrap(), []);
}

#[test]
fn an_authority_is_not_replaced_and_a_damaged_register_is_named() {
    let (folder, authority) = authority();
    assert!(CertificateAuthority::create(folder.path(), "other", None, at(NOW)).is_err());
    issue(&authority, "rover");
    let path = folder.path().join("issued");
    let text = fs::read_to_string(&path).unwrap();
    fs::write(&path, format!("{text}{}", &text[..40])).unwrap();
    let error = authority.revoke("rover", at(NOW)).unwrap_err().to_string();
    assert!(error.contains("line 2 of"), "{error}");
}

#[test]
fn a_node_under_dual_control_accepts_no_certificate_that_one_person_has_issued() {
    let (folder, authority) = authority();
    let path = |name: &str| folder.path().join(name);
    let [anna, ben] = ["anna", "ben"].map(|name| Key::create(&path(name)).unwrap());
    let approvers = format!("anna {}\nben {}\n", anna.public(), ben.public());
    fs::write(path("approvers"), approvers).unwrap();
    fs::write(path("trusted_keys"), "").unwrap();
    let own = Key::create(&path("node")).unwrap();
    let request = |ids: &str| Request {
        key: own.public(),
        ..request("rover", &[ids])
    };
    let control = DualControl::new(&path("issued"), &path("approvers"));
    let approved = |ids: &str| {
        let line = request(ids).line(at(NOW)).unwrap();
        let proposal = control.propose(&line, &anna, at(NOW)).unwrap();
        control.approve(&proposal.id(), &ben, at(NOW)).unwrap()
    };
    let approval = approved("101.255.255");
    // Hours later: it ends when it was approved to.
    let later = at(NOW + 5 * 60 * 60) + Duration::from_millis(700);
    let good = authority.issue_approved(&approval, later).unwrap();
    fs::write(path("node.crt"), &good).unwrap();

    let files = CertificateFiles {
        certificate: path("node.crt"),
        authority: path("ca.crt"),
        revoked: None,
    };
    let trust = TrustFile::load_controlled(&path("trusted_keys"), &path("approvers")).unwrap();
    let node = Credentials::load_certified(&path("node"), &files, trust, later).unwrap();
    let admit = |pem: &str| {
        let der = CertificateDer::from_pem_slice(pem.as_bytes()).unwrap();
        node.admit(&der).map(|it| it.peer.name)
    };
    assert_eq!(admit(&good).unwrap(), "rover");
    // The key of the authority alone issues nothing, with the signatures of another certificate neither,
    // nor the same one with another serial number, which a revocation would not reach.
    let alone = authority.issue(&request("101.255.255"), later).unwrap();
    let (same, number) = Request::of_line(approval.line(), later).unwrap();
    let signed = |request: &Request, number: &[u8]| {
        authority
            .sign(request, later, (number, Some(&approval)))
            .unwrap()
    };
    assert!(admit(&signed(&same, &number)).is_ok());
    let again = signed(&same, &serial().unwrap());
    let stolen = signed(&request("255.255.255"), &number);
    for pem in [alone, stolen, again] {
        let refused = admit(&pem).unwrap_err();
        assert!(matches!(refused, Rejection::Unapproved(_)), "{refused}");
    }
    // A proposal that is for a line of a trust file is none for a certificate.
    let line = format!("rover {} 101.255.255", own.public());
    let proposal = control.propose(&line, &anna, at(NOW)).unwrap();
    let refused = authority.issue_approved(&proposal, later).unwrap_err();
    assert!(matches!(refused, AuthorityError::Proposal), "{refused}");
}
