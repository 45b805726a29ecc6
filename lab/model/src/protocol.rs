//! The whole: two stations, drones, the orders on their way, faults; and what must hold in every state.

use crate::drone::{Drone, Trouble};
use crate::orders::{MOST, Order, Verb, bit};
use crate::table::{Phase, Table};
use stateright::{Model, Property};

pub type Bug = &'static str;

/// Bugs of the past, to be put back; each is found as the violation of a property.
pub const BUGS: [Bug; 13] = [
    "the newest stamp holds",
    "orders name nothing",
    "a hold takes a landing back",
    "news is not noticed",
    "any newer order confirms",
    "a hold takes off",
    "a restarted pilot obeys what it missed",
    "what came down takes off again",
    "commands without telemetry",
    "commands though it may have taken off",
    "a stopped pilot commands",
    "without an order it flies on",
    "a process ends in the air",
];

/// One who gives orders; several terminals of one person are several.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Station {
    asked: Option<u8>, // a start or a change is under way: the holds and landings before it was asked for
    known: u8,         // the number of the log, as read last
}

#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct State {
    orders: Vec<Order>, // each may reach the gateway, and a hold or a landing each pilot, at any time, never, or again
    log: Vec<u8>,       // as the gateway numbers them; each number of it may reach each pilot likewise
    stations: [Station; 2],
    drones: Vec<Drone>,
    taken: u8, // the holds and landings that anybody has taken in
    faults: u8,
    stop: bool,
    wrong: Option<&'static str>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Action {
    Ask(usize),
    Give(usize, Verb),
    Read(usize),
    Deliver(u8, usize),
    Number(u8),
    Publish(usize, usize),
    GiveStop,
    StopDriver(usize),
    StopPilot(usize),
    Time(usize, usize),
    Crash(usize),
    Begin(usize),
    Retire(usize),
    CrashDriver(usize),
    BeginDriver(usize),
    Cut(usize, bool),
    Mend(usize),
    Trouble(usize, Trouble),
}

#[derive(Clone)]
pub struct Protocol {
    pub drones: usize,
    pub faults: u8,
    pub orders: usize,
    pub stop: bool,
    pub bug: Bug,
    table: Table,
}

impl Default for Protocol {
    fn default() -> Protocol {
        Protocol { drones: 3, faults: 2, orders: 2, stop: false, bug: "", table: Table::read() }
    }
}

impl Protocol {
    fn faults_of(&self, i: usize, drone: &Drone, actions: &mut Vec<Action>) {
        if drone.alive {
            actions.push(Action::Crash(i));
            if drone.retired == 0 {
                actions.push(Action::Retire(i));
            }
            if drone.trouble == Trouble::None {
                actions.extend([Action::Trouble(i, Trouble::Holds), Action::Trouble(i, Trouble::Lands)]);
            }
        }
        if drone.driver {
            actions.push(Action::CrashDriver(i));
        }
        if drone.telemetry && drone.commands {
            actions.extend([Action::Cut(i, true), Action::Cut(i, false)]);
        }
    }

    fn give(&self, state: &mut State, s: usize, verb: Verb) {
        let station = &mut state.stations[s];
        let read = &state.log[..station.known as usize];
        let mut rightful = station.asked.unwrap_or(0);
        for k in read.iter().filter(|k| state.orders[**k as usize].verb.rank() == 0) {
            rightful |= state.orders[*k as usize].rightful; // who gave it knew them
        }
        let informed = read.iter().any(|k| state.orders[*k as usize].verb == Verb::Land);
        state.orders.push(Order { verb, giver: s as u8, number: station.known, rightful, informed });
        if verb.rank() > 0 {
            station.asked = None;
        }
    }

    /// The station reads the log; another's hold or landing that is news ends what is under way.
    fn read(&self, state: &mut State, s: usize) {
        let station = &mut state.stations[s];
        let news = state.log[station.known as usize..]
            .iter()
            .filter(|k| state.orders[**k as usize].verb.rank() > 0 && state.orders[**k as usize].giver != s as u8)
            .any(|k| station.asked.is_some_and(|asked| asked & bit(*k) == 0));
        if news && self.bug != "news is not noticed" {
            station.asked = None;
        }
        station.known = state.log.len() as u8;
    }

    /// Whether a station that hears the pilot takes its hold or landing `k` as confirmed by it.
    fn confirms(&self, state: &State, drone: &Drone, k: u8) -> bool {
        let order = state.orders[k as usize];
        if self.bug == "any newer order confirms" {
            return drone.orders.holds.is_some_and(|held| held >= k);
        }
        let Some(held) = drone.orders.holds.filter(|_| drone.orders.received(k)) else { return false };
        let on_ground = matches!(drone.phase, Phase::Grounded | Phase::Ready);
        (order.verb == Verb::Hold && on_ground) || state.orders[held as usize].verb == order.verb
    }

    fn wrong_now(&self, state: &State) -> Option<&'static str> {
        for drone in &state.drones {
            if !drone.is_cared_for(&state.orders, &self.table, self.bug) {
                return Some("nobody is in the air for ever without a pilot that flies it or a driver that lands it");
            }
            if !drone.alive {
                continue;
            }
            if let Some(held) = drone.orders.holds.map(|held| state.orders[held as usize]) {
                if held.verb.rank() == 0 && drone.orders.down & !held.rightful != 0 {
                    return Some("no hold and no landing is undone by an order that was asked for before it");
                }
            }
            for k in 0..state.orders.len() as u8 {
                let down = state.orders[k as usize].verb.rank() > 0;
                if down && self.confirms(state, drone, k) && !drone.orders.received(k) {
                    return Some("who has confirmed a hold or a landing has taken it in");
                }
            }
        }
        None
    }
}

impl Model for Protocol {
    type State = State;
    type Action = Action;

    fn init_states(&self) -> Vec<State> {
        vec![State {
            orders: Vec::new(),
            log: Vec::new(),
            stations: Default::default(),
            drones: vec![Drone::new(); self.drones],
            taken: 0,
            faults: self.faults,
            stop: false,
            wrong: None,
        }]
    }

    fn actions(&self, state: &State, actions: &mut Vec<Action>) {
        if state.wrong.is_some() {
            return;
        }
        if state.orders.len() < self.orders.min(MOST) {
            for (s, station) in state.stations.iter().enumerate() {
                actions.extend([Action::Give(s, Verb::Hold), Action::Give(s, Verb::Land)]);
                match station.asked {
                    None => actions.push(Action::Ask(s)),
                    Some(_) => actions.extend([Verb::TakeOff, Verb::Start, Verb::Formation].map(|v| Action::Give(s, v))),
                }
                actions.push(Action::Read(s));
            }
        }
        actions.extend((0..state.orders.len() as u8).filter(|k| !state.log.contains(k)).map(Action::Number));
        if self.stop && !state.stop {
            actions.push(Action::GiveStop);
        }
        for (i, drone) in state.drones.iter().enumerate() {
            if drone.alive {
                actions.extend((0..state.orders.len() as u8).map(|k| Action::Deliver(k, i)));
                actions.extend((1..=state.log.len()).map(|number| Action::Publish(number, i)));
            } else {
                actions.push(Action::Begin(i));
            }
            if state.stop {
                actions.extend([Action::StopDriver(i), Action::StopPilot(i)]);
            }
            actions.extend((0..drone.later(&state.orders, self.bug).len()).map(|way| Action::Time(i, way)));
            if !drone.driver {
                actions.push(Action::BeginDriver(i));
            }
            if !(drone.telemetry && drone.commands) {
                actions.push(Action::Mend(i));
            }
            if drone.trouble != Trouble::None {
                actions.push(Action::Trouble(i, Trouble::None));
            }
            if state.faults > 0 {
                self.faults_of(i, drone, actions);
            }
        }
    }

    fn next_state(&self, last: &State, action: Action) -> Option<State> {
        let mut state = last.clone();
        let given = state.orders.len();
        match action {
            Action::Ask(s) => {
                let own = (0..given).filter(|k| state.orders[*k].giver == s as u8 && state.orders[*k].verb.rank() > 0);
                state.stations[s].asked = Some(own.fold(state.taken, |all, k| all | 1 << k));
            }
            Action::Give(s, verb) => self.give(&mut state, s, verb),
            Action::Read(s) => self.read(&mut state, s),
            Action::Number(k) => {
                let order = state.orders[k as usize];
                let up = order.verb.rank() == 0;
                if !up || order.number as usize == state.log.len() || self.bug == "orders name nothing" {
                    state.log.push(k);
                    state.taken |= if up { 0 } else { bit(k) };
                }
            }
            Action::Publish(number, i) => state.drones[i].orders.read(&state.log[..number], &state.orders),
            Action::Deliver(k, i) => {
                if state.drones[i].orders.take(k, &state.orders, self.bug) {
                    state.wrong = Some("no hold takes a landing back");
                }
                state.taken |= state.drones[i].orders.down;
            }
            Action::GiveStop => state.stop = true,
            Action::StopDriver(i) => state.drones[i].stopped = true,
            Action::StopPilot(i) => state.drones[i].phase = Phase::Stopped,
            Action::Time(i, way) => {
                let (next, wrong) = state.drones[i].later(&state.orders, self.bug).swap_remove(way);
                state.drones[i] = next;
                state.wrong = wrong;
            }
            Action::Crash(i) => state.drones[i].end(),
            Action::Begin(i) => state.drones[i].begin(given),
            Action::Retire(i) => state.drones[i].retired = 1,
            Action::CrashDriver(i) => state.drones[i].driver = false,
            Action::BeginDriver(i) => state.drones[i].begin_driver(),
            Action::Cut(i, true) => state.drones[i].telemetry = false,
            Action::Cut(i, false) => state.drones[i].commands = false,
            Action::Mend(i) => (state.drones[i].telemetry, state.drones[i].commands) = (true, true),
            Action::Trouble(i, trouble) => state.drones[i].trouble = trouble,
        }
        let is_fault = matches!(
            action,
            Action::Crash(_) | Action::Retire(_) | Action::CrashDriver(_) | Action::Cut(..)
                | Action::Trouble(_, Trouble::Holds | Trouble::Lands)
        );
        state.faults -= u8::from(is_fault);
        for drone in &mut state.drones {
            state.wrong = state.wrong.or(drone.react(&state.orders, &self.table, self.bug));
        }
        if state.orders.len() >= self.orders.min(MOST) {
            state.stations = Default::default(); // they have no more to say
        }
        state.wrong = state.wrong.or_else(|| self.wrong_now(&state));
        state.drones.sort(); // all drones are alike
        (state != *last).then_some(state)
    }

    fn properties(&self) -> Vec<Property<Self>> {
        vec![Property::always("the protocol holds", |_, state: &State| state.wrong.is_none())]
    }
}
