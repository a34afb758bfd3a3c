//! Faults: what breaks under way. In no catalogue and never drawn by chance; asked for by name.

use super::catalogue::{FIN, TIME, entries, number, optional};
use super::{Draw, EffectKind};
use crate::truth::{Flooding, Step};

pub(super) const ENTRIES: &[EffectKind] = entries! { catalogue: false, by_name_only: true;
    "flooding", "water enters a compartment x_m ahead of the centre of gravity from a time on, until it is full",
    [
        number("kg", [0.0, 10.0], Draw::Size(0.3, 1.0)),
        number("kg_per_s", [1.0e-4, 10.0], Draw::Size(0.003, 0.1)),
        optional("x_m", 1.0, Draw::Uniform(-0.3, 0.3)),
        TIME,
    ],
    |p, v| p.undeclared.faults.flooding = Flooding { kg: v[0], kg_per_s: v[1], x_m: v[2], time_s: v[3] };

    "fin_lost", "one fin keeps this share of its lift and drag from a time on",
    [FIN, number("share", [0.0, 1.0], Draw::Uniform(0.0, 0.4)), TIME],
    |p, v| p.undeclared.faults.fins[super::catalogue::fin(v[0])] = Step { factor: v[1], time_s: v[2] };

    "entanglement", "surge drag is this many times the declared from a time on",
    [number("factor", [0.0, 20.0], Draw::Uniform(1.5, 3.0)), TIME],
    |p, v| p.undeclared.faults.drag = Step { factor: v[0], time_s: v[1] };

    "fouling", "thrust at a propeller speed is this share of the declared from a time on",
    [number("share", [0.0, 2.0], Draw::Uniform(0.5, 0.85)), TIME],
    |p, v| p.undeclared.faults.thrust = Step { factor: v[0], time_s: v[1] };
};
