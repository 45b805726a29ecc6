//! One drone: its pilot (a process that may end and begin again), its driver, its airframe, and the links between them.

use crate::orders::{Order, Orders, Verb};
use crate::protocol::Bug;
use crate::table::{Phase, Table, condition};

const LAST: u8 = 2; // silence after which the driver lands; of a retirement, that the pilot lands

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Trouble {
    None,
    Holds,
    Lands,
}

#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Drone {
    // the pilot
    pub alive: bool,
    pub phase: Phase,
    pub orders: Orders,
    born: u8,            // how many orders had been given when it began, or came down without an order
    known: Option<bool>, // whether it flies, by the newest telemetry
    deaf: bool,          // without telemetry for long
    orderless: bool,     // in flight without an order for long
    pub retired: u8,     // 1: it holds, 2: it lands, for its process is to end
    pub trouble: Trouble,
    // the links, and the driver's process
    pub telemetry: bool,
    pub commands: bool,
    pub driver: bool,
    // the driver and the airframe
    pub air: bool,
    high: bool,
    silence: u8,
    sets_down: bool, // the driver lands it, or has landed it and hears that the pilot still climbs
    pub stopped: bool,
    // not part of the protocol: the orders from before it came down, made without knowledge of a landing
    barred: u8,
    thought_down: Option<u8>, // how many orders had been given when its pilot took it for down, or began, in the air
}

impl Drone {
    pub fn new() -> Drone {
        Drone {
            alive: true,
            phase: Phase::Ready,
            orders: Orders::default(),
            born: 0,
            known: Some(false),
            deaf: false,
            orderless: false,
            retired: 0,
            trouble: Trouble::None,
            telemetry: true,
            commands: true,
            driver: true,
            air: false,
            high: false,
            silence: 0,
            sets_down: false,
            stopped: false,
            barred: 0,
            thought_down: None,
        }
    }

    /// Let everybody who is alive react, until nothing changes any more but with time.
    pub fn react(&mut self, all: &[Order], table: &Table, bug: Bug) -> Option<&'static str> {
        let mut wrong = None;
        for _ in 0..16 {
            // a bug may make it take off and land in turns
            let before = self.clone();
            if self.alive {
                if self.telemetry && self.driver {
                    (self.known, self.deaf) = (Some(self.air), false);
                }
                self.step(all, table, bug);
                let takes_off = self.phase == Phase::TakeOff && before.phase != Phase::TakeOff;
                let ordered = self.orders.holds.is_some_and(|k| all[k as usize].verb.takes_off());
                if takes_off && !ordered {
                    wrong = Some("nobody takes off who was not ordered to");
                }
                wrong = wrong.or(if takes_off { self.is_of_yesterday(all) } else { None });
            }
            let hears = self.hears(bug);
            if hears && !self.sets_down {
                self.silence = 0;
            }
            let climbs = hears && self.phase == Phase::TakeOff;
            if !self.air && !climbs {
                (self.silence, self.sets_down) = (0, false);
            }
            if *self == before {
                break;
            }
        }
        wrong
    }

    fn step(&mut self, all: &[Order], table: &Table, bug: Bug) {
        let held = self.orders.holds.map(|k| all[k as usize]);
        let verb = held.map(|order| order.verb);
        let old = self.orders.holds.is_some_and(|k| k < self.born) && bug != "a restarted pilot obeys what it missed";
        let up = verb.is_some_and(Verb::takes_off) || (verb == Some(Verb::Hold) && bug == "a hold takes off");
        let orderless = self.orderless && self.orders.holds.is_none();
        let set_down = self.sets_down && self.telemetry && self.air;
        let lands = self.trouble == Trouble::Lands || self.retired == LAST || self.deaf || orderless || set_down;
        let troubled = self.trouble != Trouble::None || self.retired > 0;
        let conditions = [
            ("airborne", self.known == Some(true)),
            ("high", self.high),
            ("unready", troubled || self.known.is_none() || self.deaf),
            ("disturbed", troubled),
            ("danger", lands),
            ("up", up),
            ("outdated", old),
            ("formation", matches!(verb, Some(Verb::Start | Verb::Formation))),
            ("landing", verb == Some(Verb::Land)),
        ];
        let holding = conditions.iter().filter(|(_, holds)| *holds).map(|(name, _)| condition(name)).sum();
        let was = self.phase;
        self.phase = table.next(was, holding);
        if self.phase.in_flight() {
            self.thought_down = None;
        }
        if was.in_flight() && self.phase == Phase::Grounded {
            if verb != Some(Verb::Land) && bug != "what came down takes off again" {
                self.born = all.len() as u8;
            }
            self.thought_down = self.air.then_some(all.len() as u8);
        }
    }

    /// Whether the driver hears commands: a pilot that was stopped, or cannot know whether its drone flies, gives none.
    fn hears(&self, bug: Bug) -> bool {
        let speaks = self.known.is_some() || bug == "commands without telemetry";
        let lost = self.deaf && !self.phase.in_flight() && bug != "commands though it may have taken off";
        let stopped = self.phase == Phase::Stopped && bug != "a stopped pilot commands";
        self.alive && self.commands && self.driver && speaks && !lost && !stopped
    }

    fn touch_down(&mut self, all: &[Order]) {
        (self.air, self.high, self.silence) = (false, false, 0);
        let before = self.thought_down.take().unwrap_or(all.len() as u8);
        self.barred = 0;
        for (k, order) in all[..before as usize].iter().enumerate() {
            if !order.informed {
                self.barred |= 1 << k;
            }
        }
    }

    /// Return what time may bring: the airframe moves, the driver and the pilot lose patience.
    pub fn later(&self, all: &[Order], bug: Bug) -> Vec<(Drone, Option<&'static str>)> {
        let hears = self.hears(bug);
        let mut found = Vec::new();
        let mut add = |change: &mut dyn FnMut(&mut Drone)| {
            let mut next = self.clone();
            change(&mut next);
            found.push((next, None));
        };
        if self.air && !self.stopped && (self.sets_down || (hears && self.phase == Phase::Landing)) {
            add(&mut |drone| drone.touch_down(all));
        }
        if self.air && self.stopped {
            add(&mut |drone| drone.touch_down(all));
        }
        let patience = self.driver || self.deaf || self.known.is_none(); // an airframe waits longer for a driver than its pilot
        if self.air && !hears && !self.sets_down && patience {
            add(&mut |drone| {
                drone.silence += 1;
                drone.sets_down = drone.silence == LAST;
            });
        }
        if self.alive && self.known.is_some() && !(self.telemetry && self.driver) && !self.deaf {
            add(&mut |drone| drone.deaf = true);
        }
        let lost = self.air && self.alive && self.orders.holds.is_none() && bug != "without an order it flies on";
        if lost && self.phase.in_flight() && !self.orderless {
            add(&mut |drone| drone.orderless = true);
        }
        if self.alive && self.retired == 1 {
            add(&mut |drone| drone.retired = LAST);
        }
        let patient = bug != "a process ends in the air";
        if self.alive && self.retired == LAST && (self.known != Some(true) && patient || !patient) {
            let wrong = (self.air && self.telemetry && self.driver).then_some("who ends leaves nobody in the air");
            let mut next = self.clone();
            next.end();
            found.push((next, wrong));
        }
        if hears && self.phase == Phase::TakeOff && !self.sets_down && !self.stopped && !self.high {
            let mut next = self.clone();
            (next.high, next.air) = (self.air, true);
            found.push((next, if self.air { None } else { self.is_of_yesterday(all) }));
        }
        found
    }

    fn is_of_yesterday(&self, all: &[Order]) -> Option<&'static str> {
        let up = self.orders.holds.filter(|k| all[*k as usize].verb.takes_off());
        let barred = up.is_some_and(|k| self.barred & 1 << k != 0 || k < self.born);
        barred.then_some("nobody takes off by an order of yesterday")
    }

    pub fn end(&mut self) {
        let airframe = self.clone();
        *self = Drone {
            alive: false,
            phase: Phase::Grounded,
            known: None,
            telemetry: airframe.telemetry,
            commands: airframe.commands,
            driver: airframe.driver,
            air: airframe.air,
            high: airframe.high,
            silence: airframe.silence,
            sets_down: airframe.sets_down,
            stopped: airframe.stopped,
            barred: airframe.barred,
            thought_down: airframe.thought_down,
            ..Drone::new()
        };
    }

    pub fn begin(&mut self, given: usize) {
        (self.alive, self.born) = (true, given as u8);
        self.thought_down = self.air.then_some(self.born);
    }

    /// Another process takes the flying drone over.
    pub fn begin_driver(&mut self) {
        (self.driver, self.silence, self.sets_down) = (true, 0, false);
    }

    /// Whether somebody flies it, or it comes down in a while, if nothing but time passes.
    pub fn is_cared_for(&self, all: &[Order], table: &Table, bug: Bug) -> bool {
        let mut drone = self.clone();
        for _ in 0..16 {
            if !drone.air {
                return true;
            }
            let Some((mut next, _)) = drone.later(all, bug).into_iter().next() else { break };
            next.react(all, table, bug);
            drone = next;
        }
        !drone.air || (drone.hears(bug) && !drone.stopped && drone.orders.holds.is_some() && drone.phase.in_flight())
    }
}
