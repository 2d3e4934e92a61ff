//! The geographic map behind the vehicle: tiles of map files that the test writes, read back as pixels
//! of the canvas.

use std::path::PathBuf;

use jaus_test_kit::map_file::{GZIP, MapFile, PNG, VECTOR, gzip, png, vector};
use jaus_vehicle::motion::{Frame, GlobalPose, Pose};
use serde_json::json;

use super::browser::{Browser, SCREENS};
use super::by_hand::Running;
use super::steps::look_from_all_screens;

/// The numbers of the multicast groups.
const PICTURES: u8 = 6;
const VECTORS: u8 = 7;
const LOCAL_ONLY: u8 = 8;

/// A tile, and the zoom level on which it is.
const ZOOM: u8 = 20;
const TILE: (u32, u32) = (563_284, 343_937);

const RED: [u8; 3] = [230, 60, 50];
const BLUE: [u8; 3] = [50, 80, 220];
const GREEN: [u8; 3] = [40, 160, 90];
const YELLOW: [u8; 3] = [240, 200, 40];

/// Position of the north-west corner of a tile.
fn corner(zoom: u8, (x, y): (u32, u32)) -> GlobalPose {
    let count = 2_f64.powi(zoom.into());
    let mercator = std::f64::consts::PI * (1.0 - 2.0 * f64::from(y) / count);
    GlobalPose {
        latitude: mercator.sinh().atan().to_degrees(),
        longitude: f64::from(x) / count * 360.0 - 180.0,
        ..GlobalPose::default()
    }
}

/// A vehicle 3 m south and 5 m west of the corner of [`TILE`], as the flag of its position.
fn place() -> String {
    let corner = corner(ZOOM, TILE);
    let frame = Frame::at(corner.latitude, corner.longitude);
    let start = frame.to_global(&Pose::at(-3.0, -5.0));
    format!("{:.8},{:.8}", start.latitude, start.longitude)
}

/// Starts a vehicle, its station with a map file, and the page.
fn start(test: u8, at: &str, file: &MapFile) -> (Running, Running, Browser) {
    let path: PathBuf = [env!("CARGO_TARGET_TMPDIR"), &format!("e2e-{test}.pmtiles")]
        .iter()
        .collect();
    std::fs::write(&path, file.encode()).unwrap();
    let vehicle = ["vehicle", "--name", "G-Bat", "--at", at];
    let (vehicle, _) = Running::start(test, "jaus", &vehicle, "Ctrl-C");
    let (station, page) = station(test, &path);
    (vehicle, station, page)
}

fn station(test: u8, file: &std::path::Path) -> (Running, Browser) {
    let flags = ["--listen", "127.0.0.1:0", "--map", file.to_str().unwrap()];
    let (station, address) = Running::station(test, &flags);
    let mut page = Browser::start(None);
    page.look_on(SCREENS[0]);
    page.open(&address);
    page.wait("document.body.dataset.link === 'live'");
    (station, page)
}

/// The colour of the map at metres north and east of the vehicle, which is in the middle of the first
/// view of 24 pixels per metre.
fn colour(page: &mut Browser, (north, east): (f64, f64)) -> [u8; 3] {
    let pixel = page.value(&format!(
        "(() => {{ const map = document.querySelector('#map'), one = document.createElement('canvas'); \
         one.width = one.height = 1; \
         const context = one.getContext('2d', {{ willReadFrequently: true }}); \
         context.drawImage(map, -Math.round(map.width / 2 + {east} * 24), -Math.round(map.height / 2 - {north} * 24)); \
         return [...context.getImageData(0, 0, 1, 1).data]; }})()"
    ));
    [0, 1, 2].map(|channel| u8::try_from(pixel[channel].as_u64().unwrap()).unwrap())
}

fn wait_for_colour(page: &mut Browser, place: (f64, f64), wanted: [u8; 3]) {
    let is_near = |found: [u8; 3]| {
        let mut channels = found.iter().zip(wanted);
        channels.all(|(&found, wanted)| found.abs_diff(wanted) <= 8)
    };
    for _ in 0..200 {
        if is_near(colour(page, place)) {
            return;
        }
        std::thread::sleep(std::time::Duration::from_millis(50));
    }
    page.screenshot("base-map-failed");
    panic!("{place:?}: {:?} instead of {wanted:?}", colour(page, place));
}

/// Four tiles meet at a corner: each one has its colour up to 20 cm from it. Then another vehicle is
/// outside the map file.
pub(crate) fn pictures() {
    let (x, y) = TILE;
    let file = MapFile::new(PNG)
        .tile((ZOOM, x - 1, y - 1), &png(RED))
        .tile((ZOOM, x, y - 1), &png(BLUE))
        .tile((ZOOM, x - 1, y), &png(GREEN))
        .tile((ZOOM, x, y), &png(YELLOW));
    let file = MapFile {
        bounds: [13.0, 52.0, 14.0, 53.0],
        ..file
    };
    let (_vehicle, _station, mut page) = start(PICTURES, &place(), &file);
    for reach in [0.2, 2.0] {
        let [south, north] = [3.0 - reach, 3.0 + reach];
        // At odd metres there is no line of the grid.
        for (place, wanted) in [
            ((north, 3.0), RED),
            ((north, 7.0), BLUE),
            ((south, 3.0), GREEN),
            ((south, 7.0), YELLOW),
            ((5.0, 5.0 - reach), RED),
            ((5.0, 5.0 + reach), BLUE),
            ((1.0, 5.0 - reach), GREEN),
            ((1.0, 5.0 + reach), YELLOW),
        ] {
            wait_for_colour(&mut page, place, wanted);
        }
    }
    page.wait("document.querySelector('#map-source').textContent === '© Testers'");
    page.wait("document.querySelector('#map-empty').hidden");
    look_from_all_screens(&mut page, "base-map-pictures");
    page_and_stack_agree_on_the_frame(&mut page);

    let far = [
        "vehicle", "--name", "Mole", "--id", "102.1.1", "--at", "10,10",
    ];
    let (_far, _) = Running::start(PICTURES, "jaus", &far, "Ctrl-C");
    page.press("#vehicle-button");
    page.wait("document.querySelectorAll('#fleet button').length === 2");
    page.press("#fleet li:last-child button");
    page.wait(
        "document.querySelector('#map-source').textContent.includes('does not cover this place')",
    );
    assert!(page.complaints().is_empty(), "{:?}", page.complaints());
}

/// The page converts places as the vehicle does, also in a frame that is turned.
fn page_and_stack_agree_on_the_frame(page: &mut Browser) {
    let frame = Frame {
        heading: 0.6,
        ..Frame::at(-33.5, 179.999)
    };
    for (x, y) in [(0.0, 0.0), (120.0, -45.0), (-900.0, 700.0)] {
        let expected = frame.to_global(&Pose::at(x, y));
        let origin = json!({ "latitude": frame.latitude, "longitude": frame.longitude,
            "heading": frame.heading });
        let found = page.value(&format!(
            "import('/projection.js').then(({{ LocalFrame, toMercator, fromMercator }}) => {{ \
             const frame = new LocalFrame({origin}); const place = frame.toGlobal({{ x: {x}, y: {y} }}); \
             const back = frame.toLocal(fromMercator(toMercator(place))); \
             return [place.latitude, place.longitude, back.x, back.y]; }})"
        ));
        let found = [0, 1, 2, 3].map(|index| found[index].as_f64().unwrap());
        assert!(
            (found[0] - expected.latitude).abs() < 1e-9,
            "{found:?} {expected:?}"
        );
        assert!(
            (found[1] - expected.longitude).abs() < 1e-9,
            "{found:?} {expected:?}"
        );
        assert!(
            (found[2] - x).abs() < 1e-4 && (found[3] - y).abs() < 1e-4,
            "{found:?}"
        );
    }
}

/// One vector tile of a lower level: water west of a line, a building in the land east of it. A tile
/// beside it is damaged, which the page says.
pub(crate) fn vectors() {
    let zoom = 15;
    let tile = (TILE.0 >> 5, TILE.1 >> 5);
    let share = |all: u32| f64::from(all & 31) / 32.0;
    // The corner of the smaller tile as fractions of this one.
    let (line, level) = (share(TILE.0), share(TILE.1));
    // 2 m to 9 m east of the line, and 2 m to 9 m south of the level.
    let metre = 1.0 / (23.3 * 32.0);
    let layers = [
        ("earth", [0.0, 0.0], [1.0, 1.0]),
        ("water", [0.0, 0.0], [line, 1.0]),
        (
            "buildings",
            [line + 2.0 * metre, level + 2.0 * metre],
            [line + 9.0 * metre, level + 9.0 * metre],
        ),
    ];
    let beside = (zoom, tile.0 - 1, tile.1);
    let file = MapFile {
        compression: GZIP,
        zooms: (10, 15),
        ..MapFile::new(VECTOR)
    };
    let file = file
        .tile((zoom, tile.0, tile.1), &gzip(&vector(&layers)))
        .tile(beside, &gzip(b"\x1a\xff\xff"));
    let (_vehicle, _station, mut page) = start(VECTORS, &place(), &file);
    let mut style = |name: &str| {
        let value = page.value(&format!(
            "getComputedStyle(document.documentElement).getPropertyValue('--base-{name}').trim()"
        ));
        let value = value.as_str().unwrap().trim_start_matches('#').to_owned();
        [0, 2, 4].map(|at| u8::from_str_radix(&value[at..at + 2], 16).unwrap())
    };
    let [land, water, building] = ["land", "water", "building"].map(&mut style);
    for (place, wanted) in [
        ((7.0, 3.0), water),
        ((7.0, 4.5), water),
        ((7.0, 5.5), land),
        ((-3.0, 11.0), building),
        ((-3.0, 5.5), land),
    ] {
        wait_for_colour(&mut page, place, wanted);
    }
    look_from_all_screens(&mut page, "base-map-vectors");
    // Zoomed out, the damaged tile is in view.
    for _ in 0..9 {
        page.press("#zoom-out");
    }
    page.wait("document.querySelector('#map-source').textContent.includes('it ends within')");
    assert!(page.complaints().is_empty(), "{:?}", page.complaints());
}

/// A vehicle that reports only its local pose has no geographic map, and the page says why.
pub(crate) fn local_only() {
    let path: PathBuf = [env!("CARGO_TARGET_TMPDIR"), "e2e-local.pmtiles"]
        .iter()
        .collect();
    let file = MapFile::new(PNG).tile((0, 0, 0), &png(RED));
    std::fs::write(&path, file.encode()).unwrap();
    let _driver = Running::start(LOCAL_ONLY, "jaus-primitive-driver", &[], ", UDP ");
    let _sensor = Running::start(LOCAL_ONLY, "jaus-local-pose-sensor", &[], ", UDP ");
    let (_station, mut page) = station(LOCAL_ONLY, &path);
    page.wait("document.querySelector('#north').textContent !== '–'");
    page.wait(
        "document.querySelector('#map-source').textContent.includes('reports no global pose')",
    );
    assert_eq!(page.text("#toasts"), "");
    assert!(page.complaints().is_empty(), "{:?}", page.complaints());
}
