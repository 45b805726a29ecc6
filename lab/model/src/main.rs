//! Explores all states of the protocol of phases and orders; README.md says what is modelled.
//!
//!     cargo run --release -- [--drones 3] [--faults 2] [--orders 2] [--stop] [--bug NAME] [--threads 4]
//!
//! Ends with 0 when every property holds in every state, with 1 when one does not; then it prints how that comes about.

mod drone;
mod orders;
mod protocol;
mod table;

use protocol::{BUGS, Protocol};
use stateright::{Checker, Model};
use std::time::Instant;

fn main() {
    let mut protocol = Protocol::default();
    let mut threads = 4;
    let mut arguments = std::env::args().skip(1);
    while let Some(name) = arguments.next() {
        let mut value = || arguments.next().unwrap_or_else(|| panic!("{name} needs a value"));
        let number = |text: String| text.parse().unwrap_or_else(|_| panic!("{text} is no number"));
        match name.as_str() {
            "--drones" => protocol.drones = number(value()),
            "--faults" => protocol.faults = number(value()) as u8,
            "--orders" => protocol.orders = number(value()),
            "--stop" => protocol.stop = true,
            "--threads" => threads = number(value()),
            "--bug" => {
                let wanted = value();
                let known = BUGS.iter().find(|bug| **bug == wanted);
                protocol.bug = known.copied().unwrap_or_else(|| panic!("the bugs are {BUGS:?}"));
            }
            "--bugs" => return BUGS.iter().for_each(|bug| println!("{bug}")),
            _ => panic!("there is no option {name}"),
        }
    }
    let begun = Instant::now();
    let checker = protocol.checker().threads(threads).spawn_bfs().join();
    let found = checker.discoveries();
    println!("{} states in {:.0} s", checker.unique_state_count(), begun.elapsed().as_secs_f64());
    for (property, path) in &found {
        println!("violated: {property}");
        path.clone().into_actions().iter().for_each(|action| println!("  {action:?}"));
        println!("  {:#?}", path.last_state());
    }
    std::process::exit(i32::from(!found.is_empty()));
}
