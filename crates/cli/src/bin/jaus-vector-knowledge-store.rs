//! `jaus-vector-knowledge-store`: stores a vehicle's objects and maps across power cuts.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use jaus::address::JausId;
use jaus_cli::failure::Failure;
use jaus_cli::runtime::between;
use jaus_cli::{Ready, launch};
use jaus_vehicle::motion::Frame;
use jaus_vehicle::parts::{Broken, KnowledgeStore, Part};
use jaus_vehicle::world::{Picture, Raster};

#[derive(Args)]
struct Flags {
    /// The store's file [default: knowledge-store.redb in $STATE_DIRECTORY, $XDG_STATE_HOME/jaus or
    /// ~/.local/state/jaus]
    #[arg(long, value_name = "FILE")]
    store: Option<PathBuf>,

    /// If the file is damaged, rename it and start with an empty store
    #[arg(long)]
    set_broken_aside: bool,

    /// Latitude of the local frame's origin in degrees, north positive
    #[arg(long, value_name = "DEGREES", default_value = "0", allow_negative_numbers = true, value_parser = |text: &str| between(text, -90.0, 90.0))]
    latitude: f64,

    /// Longitude of the local frame's origin in degrees, east positive
    #[arg(long, value_name = "DEGREES", default_value = "0", allow_negative_numbers = true, value_parser = |text: &str| between(text, -180.0, 180.0))]
    longitude: f64,

    #[command(flatten)]
    map: Map,
}

/// Initial map, unless a map of that name exists
#[derive(Args)]
#[command(next_help_heading = "Initial map, unless a map of that name exists")]
struct Map {
    /// A demo map of 16 x 16 cells around the origin
    #[arg(long, conflicts_with = "import")]
    demo_map: bool,

    /// Import a PGM image (black is impassable) or text (# impassable, . free, 0 to 9 in between),
    /// north at the top
    #[arg(long, value_name = "FILE")]
    import: Option<PathBuf>,

    /// The imported map's name
    #[arg(
        long,
        value_name = "NAME",
        default_value = "traversability",
        requires = "import"
    )]
    map_name: String,

    /// The side of a cell in metres, from 0.001 to 1000
    #[arg(long, value_name = "M", default_value = "1", requires = "import", value_parser = |text: &str| between(text, 0.001, 1000.0))]
    cell: f64,

    /// X (north) of its south-western corner in metres [default: the map is centred on the origin]
    #[arg(long, value_name = "M", requires = "import", allow_negative_numbers = true, value_parser = |text: &str| between(text, -1e7, 1e7))]
    x: Option<f64>,

    /// Y (east) of its south-western corner in metres [default: the map is centred on the origin]
    #[arg(long, value_name = "M", requires = "import", allow_negative_numbers = true, value_parser = |text: &str| between(text, -1e7, 1e7))]
    y: Option<f64>,
}

impl Ready for Flags {
    const PROGRAM: &'static str = "jaus-vector-knowledge-store";
    const ABOUT: &'static str = "Store a vehicle's objects and maps, and serve queries on them";
    const EXAMPLES: &'static str = "Examples:\n  \
        jaus-vector-knowledge-store --loopback --demo-map     for trying it\n  \
        jaus-vector-knowledge-store --import yard.pgm --cell 0.25\n  \
        jaus-vector-knowledge-store --attach --store /var/lib/jaus/world.redb";
    const ID: JausId = JausId::new(101, 61, 61);

    fn part(self) -> Result<impl Part, Failure> {
        Ok(KnowledgeStore {
            file: self.store.unwrap_or_else(usual_file),
            broken: if self.set_broken_aside {
                Broken::SetAside
            } else {
                Broken::Refuse
            },
            map: self.map.read()?,
            frame: Frame::at(self.latitude, self.longitude),
        })
    }
}

impl Map {
    fn read(self) -> Result<Option<(Raster, Picture)>, Failure> {
        if self.demo_map {
            return Ok(Some(KnowledgeStore::demo_map()));
        }
        let Some(file) = self.import else {
            return Ok(None);
        };
        if self.map_name.len() > Raster::MOST_NAME {
            return Err(Failure::new(
                "--map-name is longer than 255 octets; shorten it",
            ));
        }
        let octets = std::fs::read(&file).map_err(|error| Failure::file(&file, &error))?;
        let picture = Picture::read(&octets)
            .map_err(|error| Failure::new(format!("--import {}: {error}", file.display())))?;
        let middle = |count: u16| f64::from(count) * self.cell / -2.0;
        let corner = (
            self.x.unwrap_or_else(|| middle(picture.rows)),
            self.y.unwrap_or_else(|| middle(picture.columns)),
        );
        let raster = picture.at(self.map_name, self.cell as f32, corner);
        Ok(Some((raster, picture)))
    }
}

/// In the service manager's state directory, or in the user's.
fn usual_file() -> PathBuf {
    let set = |name: &str| std::env::var_os(name).filter(|it| !it.is_empty());
    let given = set("STATE_DIRECTORY").map(PathBuf::from);
    let users = || {
        let state = set("XDG_STATE_HOME").map(PathBuf::from);
        let state = state.or_else(|| Some(Path::new(&set("HOME")?).join(".local/state")));
        state.map(|state| state.join("jaus"))
    };
    let directory = given.or_else(users).unwrap_or_default();
    directory.join(KnowledgeStore::FILE)
}

fn main() -> ExitCode {
    launch::<Flags>()
}
