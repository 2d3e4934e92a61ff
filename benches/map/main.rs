//! How fast a knowledge store over a file answers a client on another node: maps of several sizes,
//! and changes, which are written to disk before they are answered.
//!
//! ```sh
//! cargo bench --bench map               # a quarter of a minute
//! cargo bench --bench map -- --quick    # some seconds
//! JAUS_WRITE_FIGURES=1 cargo bench --bench map    # also writes docs/figures/map.md
//! ```
//!
//! Store and client are two nodes on loopback, each with its own thread. The baseline is a
//! component on the store's node that answers the same query with the same cells from memory.
#![allow(
    clippy::disallowed_methods,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a benchmark owns the clock and panics on failure"
)]

use std::future::Future;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use bytes::Bytes;
use jaus::address::JausId;
use jaus::component::{Component, Handlers, Kind};
use jaus::node::{Config, Node};
use jaus::service::Patience;
use jaus_test_kit::figures::Figures;
use jaus_vehicle::ground::WorldStore;
use jaus_vehicle::messages::ground::{
    QueryRasterCells, QueryVksTraversability, ReportRasterCells, ReportRasterChange,
    SetRasterCells, raster_maps, report_raster_change,
};
use jaus_vehicle::motion::Frame;
use jaus_vehicle::world::{Change, Raster, World};

const STORE: JausId = JausId::new(101, 1, 61);
const BASELINE: JausId = JausId::new(101, 1, 62);
const SIDES: [u16; 4] = [16, 64, 256, 1024];
/// The longest median that is aimed for, in milliseconds, by side length.
const AIMS: [(u16, f64); 2] = [(16, 2.0), (1024, 250.0)];

fn main() {
    let quick = std::env::args().any(|argument| argument == "--quick");
    let directory = directory();
    let (started, ready) = std::sync::mpsc::channel();
    let file = directory.join("world.redb");
    std::thread::spawn(move || runtime().block_on(serve(&file, &started)));
    ready.recv().expect("a store");
    let mut figures = Figures::new("map", "cargo bench --bench map");
    runtime().block_on(measure(if quick { 20 } else { 200 }, &mut figures));
    figures.finish();
    std::fs::remove_dir_all(&directory).expect("removed");
}

/// A directory on a disk: the directory for temporary files may be in memory.
fn directory() -> PathBuf {
    let directory = Path::new(env!("CARGO_TARGET_TMPDIR")).join("map-bench");
    let _ = std::fs::remove_dir_all(&directory);
    directory
}

fn runtime() -> tokio::runtime::Runtime {
    tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .expect("a runtime")
}

/// Serves one map per side length, with no cell at its initial value.
async fn serve(file: &Path, started: &std::sync::mpsc::Sender<()>) {
    let mut world = World::open(file).expect("a world");
    for side in SIDES {
        let raster = Raster {
            name: if side == 16 { "traversability" } else { "map" }.to_owned(),
            rows: side,
            columns: side,
            cell: 1.0,
            x: 0.0,
            y: 0.0,
            fill: 255,
            revision: 0,
        };
        let change = Change::AddRaster(raster, cells(side));
        assert!(world.apply(vec![change]).expect("kept")[0].is_ok());
    }
    let node = Node::start(Config::loopback(101, 1)).expect("a node");
    let store = WorldStore::new(world, Frame::default(), |error| panic!("{error}"));
    let component = Component::builder(Kind::Vehicle, "Bench")
        .offer(store.raster_maps())
        .offer(store.vector_knowledge_store())
        .attach(&node, STORE.component())
        .expect("a store");
    let maps = SIDES.map(cells);
    let from_memory = Handlers::new(raster_maps::LATEST).answer(move |query: QueryRasterCells| {
        let side = SIDES[usize::from(query.map) - 1];
        ReportRasterCells {
            map: query.map,
            rows: side,
            columns: side,
            cells: maps[usize::from(query.map) - 1].clone(),
            ..ReportRasterCells::default()
        }
    });
    let baseline = Component::builder(Kind::Vehicle, "Bench")
        .offer(from_memory)
        .attach(&node, BASELINE.component())
        .expect("a baseline");
    started.send(()).expect("somebody waits");
    std::future::pending::<()>().await;
    drop((component, baseline));
}

fn cells(side: u16) -> Bytes {
    let count = usize::from(side) * usize::from(side);
    (0..count).map(|i| (i % 255) as u8).collect()
}

async fn measure(runs: usize, figures: &mut Figures) {
    let node = Node::start(Config::loopback(101, 2)).expect("a node");
    // A repeated query means that no answer arrived in time.
    let patience = Patience {
        tries: 1,
        interval: Duration::from_secs(2),
    };
    let client = Component::builder(Kind::Vehicle, "Bench")
        .patience(patience)
        .attach(&node, 1)
        .expect("a client");
    client.find(raster_maps::URN).await.expect("a store");
    figures.table(
        "Answers of a knowledge store to a client on another node",
        [
            "answer",
            "median (ms)",
            "p99 (ms)",
            "most (ms)",
            "median from memory (ms)",
        ],
    );
    let mut aims = Vec::new();
    for (map, side) in (1..).zip(SIDES) {
        let runs = if side < 1024 { runs * 5 } else { runs };
        let stored = time(runs, || fetch(&client, STORE, map, side)).await;
        let memory = time(runs, || fetch(&client, BASELINE, map, side)).await;
        let what = format!("cells of a map of {side} x {side}");
        row(figures, &what, &stored, Some(&memory));
        let aim = AIMS.iter().find(|(of, _)| *of == side);
        aims.extend(aim.map(|(_, most)| (what, quantile(&stored, 0.5) < *most)));
    }
    let objects = time(runs, || traversability(&client)).await;
    row(
        figures,
        "the map of 16 x 16 as objects (2423h)",
        &objects,
        None,
    );
    for (map, side) in (1..).zip(SIDES) {
        let cells = cells(side);
        let written = time(runs.min(100), || set(&client, map, side, cells.clone())).await;
        let what = format!("a change of {side} x {side} cells, stored");
        row(figures, &what, &written, None);
    }
    let aims = aims.iter().map(|(what, is_met)| (what.as_str(), *is_met));
    figures.aim("16 x 16 cells within 2 ms, 1024 x 1024 within 250 ms", aims);
}

/// Milliseconds of each run, sorted, after five warm-up runs.
async fn time<F: Future<Output = ()>>(runs: usize, mut run: impl FnMut() -> F) -> Vec<f64> {
    let mut times = Vec::with_capacity(runs);
    for _ in 0..5 {
        run().await;
    }
    for _ in 0..runs {
        let begin = Instant::now();
        run().await;
        times.push(begin.elapsed().as_secs_f64() * 1e3);
    }
    times.sort_by(f64::total_cmp);
    times
}

fn quantile(sorted: &[f64], share: f64) -> f64 {
    let last = sorted.len() - 1;
    sorted[(last as f64 * share).round() as usize]
}

fn row(figures: &mut Figures, what: &str, times: &[f64], baseline: Option<&[f64]>) {
    let at = |times: &[f64], share| format!("{:.2}", quantile(times, share));
    let baseline = baseline.map_or(String::new(), |it| at(it, 0.5));
    figures.row([
        what,
        &at(times, 0.5),
        &at(times, 0.99),
        &at(times, 1.0),
        &baseline,
    ]);
}

async fn fetch(client: &Component, store: JausId, map: u16, side: u16) {
    let query = QueryRasterCells {
        map,
        ..QueryRasterCells::default()
    };
    let report = client.query(store, &query).await.expect("an answer");
    assert_eq!((report.rows, report.columns), (side, side));
    assert_eq!(report.cells.len(), usize::from(side) * usize::from(side));
}

async fn traversability(client: &Component) {
    let mut query = QueryVksTraversability::default();
    query.request_rec.response_presence_vector = 1;
    let report = client.query(STORE, &query).await;
    report.expect("an answer");
}

async fn set(client: &Component, map: u16, side: u16, cells: Bytes) {
    let mut messages = client.messages();
    let set = SetRasterCells {
        map,
        rows: side,
        columns: side,
        cells,
        ..SetRasterCells::default()
    };
    client.deliver(STORE, &set).await.expect("delivered");
    let answer = tokio::time::timeout(Duration::from_secs(10), messages.next());
    let message = answer.await.expect("in time").expect("an answer");
    let report = <ReportRasterChange as jaus::codec::Message>::decode(&message.payload);
    let done = report_raster_change::Result_::DONE;
    assert_eq!(report.expect("the answer").result, done);
}
