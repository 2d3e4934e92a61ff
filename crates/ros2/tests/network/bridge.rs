//! The program with a vehicle of real parts on one side and Python as ROS 2 on the other.

use std::io::{BufRead as _, BufReader};
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use jaus_test_kit::waiting::{LIMIT, until};

use crate::rover::Rover;
use crate::scene::{Script, endpoint};

/// The program, which is killed when it is dropped.
pub(crate) struct Bridge(pub(crate) Child);

impl Drop for Bridge {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A vehicle, the program, a router, and what Python sees of the vehicle.
struct Scene {
    rover: Rover,
    network: String,
    router: Option<Script>,
    _bridge: Bridge,
    log: Arc<Mutex<String>>,
    seen: Arc<Mutex<Seen>>,
    _watcher: JoinHandle<()>,
}

/// What Python has printed.
#[derive(Default)]
struct Seen {
    /// East, north, and the forward velocity.
    odometry: Option<[f64; 3]>,
    /// The last lines of all states.
    status: Vec<String>,
}

impl Seen {
    fn note(&mut self, line: &str) {
        if let Some(odometry) = line.strip_prefix("odom ") {
            let numbers: Vec<f64> = odometry.split(' ').map(|it| it.parse().unwrap()).collect();
            self.odometry = numbers.try_into().ok();
        } else if let Some(status) = line.strip_prefix("status ") {
            let (name, _) = status.split_once(':').unwrap();
            self.status.retain(|it| !it.starts_with(name));
            self.status.push(status.to_owned());
        }
    }
}

impl Scene {
    fn start(flags: &[&str]) -> Self {
        let now = SystemTime::now().duration_since(UNIX_EPOCH);
        let mut rover = Rover::new(now.unwrap());
        rover.start_vehicle();
        let network = endpoint();
        let router = Script::router(&network);
        let bridge = Command::new(env!("CARGO_BIN_EXE_jaus-ros2"))
            .args(["--loopback", "--port", "0", "--id", "101.252.1"])
            .args(["--group", &rover.group.to_string()])
            .args(["--vehicle", "101", "--connect", &network, "--rate", "20"])
            .args(flags)
            .env_remove("ROS_DOMAIN_ID")
            .stdin(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut bridge = Bridge(bridge);
        let log = Arc::default();
        keep_log(&mut bridge, &log);
        let seen = Arc::new(Mutex::new(Seen::default()));
        let mut script = python(&network, &["watch"]);
        let notes = seen.clone();
        let watcher = std::thread::spawn(move || {
            while let Some(line) = script.line() {
                notes.lock().unwrap().note(&line);
            }
        });
        Self {
            rover,
            network,
            router: Some(router),
            _bridge: bridge,
            log,
            seen,
            _watcher: watcher,
        }
    }

    fn python(&self, arguments: &[&str]) -> Script {
        python(&self.network, arguments)
    }

    fn odometry(&self) -> Option<[f64; 3]> {
        self.seen.lock().unwrap().odometry
    }

    /// Forward, in m/s; 0 before the first odometry.
    fn speed(&self) -> f64 {
        self.odometry().map_or(0.0, |[_, _, speed]| speed)
    }

    fn says(&self, text: &str) -> bool {
        let seen = self.seen.lock().unwrap();
        seen.status.iter().any(|it| it.contains(text))
    }

    /// Whether the program has logged this.
    fn has_logged(&self, text: &str) -> bool {
        self.log.lock().unwrap().contains(text)
    }

    async fn is_seen(&self) {
        until(|| self.odometry().is_some() && self.says("primitive driver")).await;
    }

    async fn drives(&self) {
        until(|| self.speed() > 0.5).await;
    }

    async fn stands(&self) {
        until(|| self.speed().abs() < 0.01).await;
    }
}

/// Keeps what the program logs, and prints it.
fn keep_log(bridge: &mut Bridge, log: &Arc<Mutex<String>>) {
    let (log, lines) = (log.clone(), BufReader::new(bridge.0.stderr.take().unwrap()));
    std::thread::spawn(move || {
        for line in lines.lines().map_while(Result::ok) {
            eprintln!("{line}");
            log.lock().unwrap().push_str(&line);
        }
    });
}

fn python(network: &str, arguments: &[&str]) -> Script {
    let arguments = [&[network], arguments].concat();
    Script::start("crates/ros2/tests/network/rover.py", &arguments).ready()
}

const CONTROL: [&str; 2] = ["--rights", "control=127 clear-emergency"];
/// With the longest timeout, so that another reason stops the vehicle first.
const PATIENT: [&str; 4] = ["--rights", "control=127", "--timeout", "2s"];

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "needs packages of Python: run .ci/ros2"]
async fn python_drives_the_vehicle_and_sees_it_move_and_it_stops_when_python_dies() {
    let scene = Scene::start(&PATIENT);
    scene.is_seen().await;
    let [_, before, _] = scene.odometry().unwrap();
    let pilot = scene.python(&["drive", "1.0", "0.0"]);
    scene.drives().await;
    // North, which is Y.
    until(|| {
        scene
            .odometry()
            .is_some_and(|[_, north, _]| north > before + 1.0)
    })
    .await;
    assert_eq!(scene.rover.controller().await, 101);
    drop(pilot);
    until(|| scene.has_logged("the publisher of cmd_vel is gone: stopping")).await;
    scene.stands().await;
    scene.rover.end().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "needs packages of Python: run .ci/ros2"]
async fn the_death_of_the_router_stops_the_vehicle() {
    let mut scene = Scene::start(&PATIENT);
    scene.is_seen().await;
    let _pilot = scene.python(&["drive", "1.0", "0.0"]);
    scene.drives().await;
    drop(scene.router.take());
    // The tokens of all publishers may be withdrawn before the connection counts as lost.
    until(|| {
        scene.has_logged("the ROS network was lost: stopping")
            || scene.has_logged("the publisher of cmd_vel is gone: stopping")
    })
    .await;
    // Python sees nothing any more, so the vehicle itself is asked.
    let end = tokio::time::Instant::now() + LIMIT;
    while scene.rover.reported_speed().await.abs() > 0.01 {
        assert!(tokio::time::Instant::now() < end, "it does not stop");
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
    scene.rover.end().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "needs packages of Python: run .ci/ros2"]
async fn python_stops_the_vehicle_by_an_emergency_and_clears_it() {
    let scene = Scene::start(&CONTROL);
    scene.is_seen().await;
    let _pilot = scene.python(&["drive", "1.0", "0.0"]);
    scene.drives().await;
    let stop = scene.python(&["emergency", "1"]);
    until(|| scene.says("Driver: emergency")).await;
    scene.stands().await;
    drop(stop);
    let _clear = scene.python(&["emergency", "0"]);
    until(|| !scene.says("Driver: emergency")).await;
    // The pilot goes on, and has neither stopped nor paused.
    tokio::time::sleep(Duration::from_secs(1)).await;
    assert!(scene.speed().abs() < 0.01);
    scene.rover.end().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "needs packages of Python: run .ci/ros2"]
async fn python_sends_the_vehicle_to_a_goal_by_its_planner() {
    let mut scene = Scene::start(&CONTROL);
    scene.rover.start_planner();
    scene.is_seen().await;
    until(|| scene.says("Planner")).await;
    let _goal = scene.python(&["goal", "0", "4"]);
    until(|| scene.says("goal=arrived")).await;
    let [east, north, _] = scene.odometry().unwrap();
    assert!((north - 4.0).hypot(east) < 1.0, "{east} {north}");
    scene.rover.end().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "needs packages of Python: run .ci/ros2"]
async fn by_default_python_sees_the_vehicle_and_moves_nothing() {
    let scene = Scene::start(&["--report", "ReportWrenchEffort"]);
    scene.is_seen().await;
    let mut report = scene.python(&["report", "/c33_33/report_wrench_effort"]);
    let line = report.line().unwrap();
    let name = "jaus_msgs::msg::dds_::MobilityReportWrenchEffort";
    assert!(line.starts_with(name), "{line}");
    let _pilot = scene.python(&["drive", "1.0", "0.0"]);
    until(|| scene.says("commands refused by the rights of ROS")).await;
    assert!(scene.speed().abs() < 0.01);
    assert_eq!(scene.rover.controller().await, 0);
    scene.rover.end().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "needs packages of Python: run .ci/ros2"]
async fn what_nodes_do_by_their_topics_is_in_the_audit_file_with_the_publisher() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("audit.jsonl");
    let scene = Scene::start(&[&CONTROL[..], &["--audit", log.to_str().unwrap()]].concat());
    scene.is_seen().await;
    let _pilot = scene.python(&["drive", "1.0", "0.0"]);
    scene.drives().await;
    let _stop = scene.python(&["emergency", "1"]);
    let who = |what: &str| {
        let lines = std::fs::read_to_string(&log).unwrap_or_default();
        let of_publisher = |line: &&str| {
            line.contains("\"who\":\"ROS publisher ")
                && line.contains(&format!("\"message\":\"{what}\""))
                && line.contains("\"result\":\"allowed\"")
        };
        let line = lines.lines().find(of_publisher)?;
        let (_, who) = line.split_once("ROS publisher ")?;
        who.split('"').next().map(str::to_owned)
    };
    until(|| who("SetEmergency").is_some()).await;
    let pilot = who("RequestControl").unwrap();
    assert_eq!(who("ConfirmControl"), Some(pilot.clone()));
    assert_ne!(who("SetEmergency"), Some(pilot), "another node's");
    scene.rover.end().await;
}
