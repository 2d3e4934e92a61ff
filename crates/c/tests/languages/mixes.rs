//! The same small system in every mix of languages, over UDP and over the local link.

use jaus_test_kit::waiting::within_limit;

use super::parts::{Driver, Language, Network, missing, operate, sensor};

/// The languages of the sensor, the driver and the operator.
type Mix = [Language; 3];

/// Runs the system. Panics if a part does not do what it must.
async fn run(mix: Mix, network: Network) {
    println!("{mix:?}");
    let _sensor = sensor(mix[0], &network).await;
    let mut driver = Driver::start(mix[1], &network).await;
    let operator = operate(mix[2], &network).await;
    driver.moves().await;
    within_limit(operator).await.unwrap();
    driver.stops().await;
}

async fn run_over_udp(mix: Mix) {
    run(mix, Network::udp()).await;
}

async fn run_over_the_local_link(mix: Mix) {
    let folder = tempfile::tempdir().unwrap();
    run(mix, Network::local_link(folder.path())).await;
}

/// The mixes whose languages are there.
fn possible(mixes: impl IntoIterator<Item = Mix>) -> Vec<Mix> {
    let missing = missing();
    let is_possible = |mix: &Mix| !mix.iter().any(|it| missing.contains(it));
    mixes.into_iter().filter(is_possible).collect()
}

/// Each language once in each part.
fn turns() -> [Mix; 3] {
    let [rust, cpp, python] = Language::ALL;
    [
        [rust, cpp, python],
        [cpp, python, rust],
        [python, rust, cpp],
    ]
}

/// All combinations.
fn every() -> impl Iterator<Item = Mix> {
    let all = || Language::ALL.into_iter();
    all().flat_map(move |sensor| {
        all().flat_map(move |driver| all().map(move |operator| [sensor, driver, operator]))
    })
}

/// Several threads: the test waits for lines of programs, too.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn each_language_works_in_each_part_over_udp() {
    for mix in possible(turns()) {
        run_over_udp(mix).await;
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn each_language_works_in_each_part_over_the_local_link() {
    for mix in possible(turns()) {
        run_over_the_local_link(mix).await;
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "three minutes; .ci/languages runs it"]
async fn every_mix_of_languages_works_over_udp() {
    for mix in possible(every()) {
        run_over_udp(mix).await;
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "three minutes; .ci/languages runs it"]
async fn every_mix_of_languages_works_over_the_local_link() {
    for mix in possible(every()) {
        run_over_the_local_link(mix).await;
    }
}
