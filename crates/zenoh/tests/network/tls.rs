//! TLS and access control, with the settings that the guide shows.

use std::path::Path;
use std::process::Command;

use jaus::messages::mobility::QueryWrenchEffort;
use jaus_test_kit::tools::workspace;
use jaus_test_kit::waiting::{until, within_limit};
use tempfile::TempDir;

use super::scene::{System, effort, endpoint, operator, router, rover};

/// The block of the guide whose first line names this file.
fn of_guide(file: &str) -> String {
    let guide = std::fs::read_to_string(workspace("docs/zenoh.md")).unwrap();
    let mut blocks = guide.split("```json5\n").skip(1);
    let block = blocks.find(|block| block.starts_with(&format!("// {file}")));
    let block = block.unwrap_or_else(|| panic!("no {file} in the guide"));
    block.split("```").next().unwrap().to_owned()
}

fn openssl(folder: &Path, arguments: &str) {
    let mut openssl = Command::new("openssl");
    let output = openssl.args(arguments.split(' ')).current_dir(folder);
    let output = output.output().unwrap();
    assert!(output.status.success(), "{arguments}: {output:?}");
}

const KEY: &str = "-newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes";

/// An authority, and certificates with these common names.
fn certificates(names: &[&str]) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let authority =
        format!("req -x509 {KEY} -keyout ca.key -out zenoh-ca.pem -subj /CN=ca -days 9");
    openssl(at, &authority);
    let names_of_host = "subjectAltName=DNS:localhost,IP:127.0.0.1";
    std::fs::write(at.join("names"), names_of_host).unwrap();
    for name in names {
        let request = format!("req {KEY} -keyout {name}.key -out {name}.csr -subj /CN={name}");
        openssl(at, &request);
        let issue = format!(
            "x509 -req -in {name}.csr -CA zenoh-ca.pem -CAkey ca.key -CAcreateserial \
             -out {name}.pem -days 9 -extfile names"
        );
        openssl(at, &issue);
    }
    folder
}

/// The settings of a bridge, with its certificate.
fn of_bridge(folder: &Path, name: &str, endpoint: &str) -> String {
    let settings = of_guide("tls.json5")
        .replace("tls/router.example:7447", endpoint)
        .replace("/etc/jaus/zenoh-ca", &at(folder, "zenoh-ca"))
        .replace("/etc/jaus/rover", &at(folder, name));
    let file = folder.join(format!("{name}.json5"));
    std::fs::write(&file, settings).unwrap();
    file.display().to_string()
}

fn at(folder: &Path, name: &str) -> String {
    folder.join(name).display().to_string()
}

#[tokio::test]
#[ignore = "needs the Python package eclipse-zenoh: run .ci/zenoh"]
async fn a_certificate_publishes_as_its_own_subsystem_and_as_no_other() {
    let folder = certificates(&["router", "rover-101", "operator-60"]);
    let folder = folder.path();
    let network = endpoint().replace("tcp/127.0.0.1", "tls/localhost");
    let tls = format!(
        "{{ transport: {{ link: {{ tls: {{ enable_mtls: true, root_ca_certificate: \"{}\",
         listen_certificate: \"{}\", listen_private_key: \"{}\" }} }} }},",
        at(folder, "zenoh-ca.pem"),
        at(folder, "router.pem"),
        at(folder, "router.key"),
    );
    let settings = of_guide("router.json5").replacen("\n{", &format!("\n{tls}"), 1);
    let file = at(folder, "router.json5");
    std::fs::write(&file, settings).unwrap();
    let _router = router(&network, &["--config", &file]);

    let (vehicles, operators) = (System::new(), System::new());
    let (own, foreign) = (vehicles.node(101, 1), vehicles.node(102, 1));
    let (own, foreign) = (rover(&own), rover(&foreign));
    let at_operator = operators.node(60, 1);
    let operator = operator(&at_operator);
    let flags = |name: &str| {
        [
            "--zenoh-config".to_owned(),
            of_bridge(folder, name, &network),
        ]
    };
    let [at_rover, beside_operator] = ["rover-101", "operator-60"].map(flags);
    let _bridges = [
        vehicles.bridge("101.250.1", &at_rover.each_ref().map(String::as_str)),
        operators.bridge("60.250.1", &beside_operator.each_ref().map(String::as_str)),
    ];

    until(|| operator.directory().component(own.id()).is_some()).await;
    assert!(effort(&operator, own.id()).await < 0.1);
    let query = QueryWrenchEffort::all();
    let refused = within_limit(operator.query(foreign.id(), &query)).await;
    assert!(refused.is_err(), "{refused:?}");
    assert!(operator.directory().component(foreign.id()).is_none());
}
