//! One trial: the operators begin, things go wrong, and at the end, when all is well, both drive.

use std::time::Duration;

use jaus_test_kit::random::Random;

use crate::cable::Wire;
use crate::mishaps::{self, Mishaps};
use crate::operator::{Intent, Operator};
use crate::world::World;

/// When things begin to go wrong.
const BEGIN: Duration = Duration::from_secs(3);
/// When they end.
const END: Duration = Duration::from_secs(13);
/// Then both operators drive within this time: control may have to time out first.
const PATIENCE: Duration = Duration::from_secs(25);

/// What was stopped is held for so long.
const PUSHING: Duration = Duration::from_secs(4);

/// What was seen in a trial.
#[derive(Debug)]
pub(crate) struct Outcome {
    pub(crate) broken: Option<String>,
    pub(crate) longest: Duration,
    pub(crate) moved: u32,
    pub(crate) emergencies: u32,
}

/// A trial in which everything may go wrong.
pub(crate) fn run_rough(seed: u64) -> Outcome {
    let mut world = World::new(seed, [1.0; 5]);
    let mut operators = [0, 1].map(|page| Operator::new(page, Intent::Any));
    let mut mishaps = Mishaps::new(BEGIN);
    while world.now < END && !world.witness.is_done(world.now) {
        mishaps.live(&mut world);
        live(&mut world, &mut operators);
    }
    mishaps.heal(&mut world);
    for (page, operator) in operators.iter_mut().enumerate() {
        world.let_go(page);
        operator.intent = Intent::Drive(page);
    }
    let end = world.now + PATIENCE;
    while world.now < end && !world.witness.is_done(world.now) {
        live(&mut world, &mut operators);
        if world.witness.drives(0) && world.witness.drives(1) {
            return outcome(world);
        }
    }
    if world.witness.broken.is_none() {
        let views: Vec<_> = world.pages.iter().map(|page| &page.view).collect();
        let what = format!("all is well, and not both drive: {views:?}");
        world.witness.broken = Some(what);
    }
    outcome(world)
}

/// A trial in which an operator presses stop at the moment when something fails. Nobody clears it: once all
/// is well it must have acted, and no hand may move the vehicle.
pub(crate) fn run_stopped(seed: u64) -> Outcome {
    let mut world = World::new(seed, [1.0; 5]);
    let mut operators = [0, 1].map(|page| Operator::new(page, Intent::Any));
    let mut mishaps = Mishaps::new(BEGIN);
    let (press, page) = (world.random.between(&(BEGIN..END)), world.random.below(2));
    while world.now < END && !world.witness.is_done(world.now) {
        if world.now >= press && operators[page].intent == Intent::Any {
            operators
                .iter_mut()
                .for_each(|it| it.intent = Intent::Nothing);
            mishaps.strike(&mut world, page);
        }
        mishaps.live(&mut world);
        live(&mut world, &mut operators);
    }
    mishaps.heal(&mut world);
    let end = world.now + PATIENCE;
    while world.now < end && world.witness.awaits_stops() && !world.witness.is_done(world.now) {
        live(&mut world, &mut operators);
    }
    if world.witness.awaits_stops() {
        world
            .witness
            .break_rule(world.now, "all is well, and a stop has not arrived");
    }
    operators.iter_mut().for_each(|it| it.intent = Intent::Push);
    let end = world.now + PUSHING;
    while world.now < end && !world.witness.is_done(world.now) {
        live(&mut world, &mut operators);
    }
    outcome(world)
}

/// A trial in which only the clocks are wrong, over links of up to 300 ms each way.
pub(crate) fn run_quiet(seed: u64) -> Outcome {
    let mut random = Random::new(seed);
    let rates = [(); 5].map(|()| random.choose(&[1.0, 1.08, 0.92]));
    let mut world = World::new(seed, rates);
    for page in 0..2 {
        world.pages[page].cable.wire = Wire {
            delay: Duration::from_millis(world.random.choose(&[1, 10, 20, 100, 200, 300])),
            jitter: Duration::from_millis(world.random.choose(&[1, 5, 20])),
            ..Wire::good()
        };
    }
    let mut operators = [0, 1].map(|page| Operator::new(page, Intent::Drive(page)));
    world.witness.is_quiet = true;
    while world.now < END && !world.witness.is_done(world.now) {
        if world.random.happens(2) {
            mishaps::step_a_clock(&mut world);
        }
        live(&mut world, &mut operators);
    }
    if world.witness.broken.is_none() && world.witness.moved < 2 {
        world.witness.broken = Some(format!("only {} hands drove", world.witness.moved));
    }
    outcome(world)
}

fn live(world: &mut World, operators: &mut [Operator]) {
    for operator in operators {
        operator.live(world);
    }
    world.step();
}

fn outcome(world: World) -> Outcome {
    let witness = world.witness;
    Outcome {
        broken: witness.broken,
        longest: witness.longest,
        moved: witness.moved,
        emergencies: witness.emergencies_checked,
    }
}
