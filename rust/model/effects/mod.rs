//! Physical effects that the plain models lack.
//!
//! **To add one**: write a file like [`quadratic_drag`](QuadraticDrag) that states the formula, its
//! parameters with units and ranges, and the slots it enters. Then add its `mod` line below and its
//! name to the list at the end of this file. The constructor, the fit, the list of candidates, its
//! documentation and the generic tests follow. A [`Formula`] is an effect written as text at run time.

mod cable_torque;
mod constant_torque;
mod coulomb;
mod cubic_drag;
mod drive_drift;
mod drive_ripple;
mod dry_friction;
mod eccentric_mass;
mod formula;
mod lateral_slip;
mod load_coulomb;
mod load_drive;
mod load_friction;
mod local_brake;
mod power_drag;
mod quadratic_drag;
mod radial_friction;
mod radial_slip;
mod relaxation;
mod slip;
mod stribeck;
mod term;
mod threshold_drag;
mod tilt;
mod uneven_disk;
mod warming_friction;
mod wheel_ripple;

pub use dry_friction::{Contact, Dry, FrictionModel};
pub use formula::Formula;
pub use term::{Effect, Source, Term};

use crate::scalar::Scalar;

/// The inputs of an effect: the state and the plain model's quantities.
#[derive(Clone, Copy, Debug)]
pub struct EffectInputs<S> {
    /// Time, s.
    pub t: S,
    /// Angular velocity, rad/s.
    pub omega: S,
    /// `|Omega|`, rad/s.
    pub speed: S,
    /// Centre of mass, horizontal, m.
    pub y: S,
    /// Centre of mass, vertical, m.
    pub z: S,
    /// Orientation of the body, rad.
    pub beta: S,
    /// The plain friction coefficient, m^2/s.
    pub k: S,
    /// Moment of inertia about the pivot, per unit mass, m^2.
    pub inertia: S,
    /// Drive speed, m/s; zero for a pendulum.
    pub w: S,
    /// Gravity, m/s^2.
    pub g: S,
    /// Disk radius (a pendulum's length), m.
    pub radius: S,
    /// The state of dry friction's contact.
    pub contact: Contact<S>,
}

impl<S: Scalar> EffectInputs<S> {
    /// `F/g - 1` of the contact's force along the drive, `F = g + d^2Z/dT^2`, in the plain model.
    #[inline(always)]
    fn excess_load(&self) -> S {
        let acceleration =
            (self.g * self.y - self.k * self.omega - self.w * self.z * self.omega) / self.inertia;
        -(self.z * self.omega.square() + self.y * acceleration) / self.g
    }
}

/// The parts of the equations that effects enter, summed over the effects.
#[derive(Clone, Copy, Debug)]
pub struct Contributions<S> {
    /// Torque per unit mass, m^2/s^2.
    pub torque: S,
    /// Adds to the friction coefficient `k`, m^2/s.
    pub friction: S,
    /// The contact's lateral velocity `u`, m/s.
    pub lateral: S,
    /// Adds to the contact's vertical velocity `W_c`, m/s.
    pub vertical: S,
    /// How the effect that enters treats dry friction.
    pub treatment: FrictionModel,
    /// The part of dry friction that is no torque.
    pub dry: Dry<S>,
}

impl<S: Scalar> Default for Contributions<S> {
    #[inline]
    fn default() -> Self {
        let zero = S::zero();
        let treatment = FrictionModel::Smoothed;
        Self { torque: zero, friction: zero, lateral: zero, vertical: zero, treatment, dry: Dry::default() }
    }
}

/// The name of a slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Slot {
    Torque,
    Friction,
    Lateral,
    Vertical,
}

impl Slot {
    /// All of them.
    pub const ALL: &[Slot] = &[Slot::Torque, Slot::Friction, Slot::Lateral, Slot::Vertical];

    /// Its name in Python.
    pub fn name(self) -> &'static str {
        match self {
            Slot::Torque => "torque",
            Slot::Friction => "friction",
            Slot::Lateral => "lateral",
            Slot::Vertical => "vertical",
        }
    }
}

/// The bodies that an effect acts on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Body {
    Disk,
    Pendulum,
}

impl Body {
    /// Its name in Python.
    pub fn name(self) -> &'static str {
        match self {
            Body::Disk => "disk",
            Body::Pendulum => "pendulum",
        }
    }
}

/// How a change of the contact's velocity enters the angular momentum.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Momentum {
    /// The exact equation: the velocity and its rate of change exert a torque.
    Consistent,
    /// Only the rolling constraint changes; this is how the paper adds `-B w z`.
    Constraint,
}

impl Momentum {
    /// Its name in Python.
    pub fn name(self) -> &'static str {
        match self {
            Momentum::Consistent => "consistent",
            Momentum::Constraint => "constraint",
        }
    }
}

/// The role of a parameter in its formula, and so in a fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Role {
    /// The effect is proportional to it and absent where all amplitudes are zero.
    Amplitude,
    /// It shapes the formula; a scan of candidates tries these values.
    Shape(&'static [f64]),
    /// A frequency in Hz that a scan of candidates searches.
    Frequency,
    /// A number that a scan of candidates searches: an `angle`, a `speed`, a `power` or a `duration`.
    Scanned(&'static str),
}

/// One parameter of an effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EffectParameter {
    pub name: &'static str,
    /// SI unit; empty where dimensionless.
    pub unit: &'static str,
    /// The value taken where none is given.
    pub default: f64,
    /// The physically sensible range, outside which a candidate is refused.
    pub range: (f64, f64),
    pub role: Role,
}

impl EffectParameter {
    const fn new(name: &'static str, unit: &'static str, default: f64, role: Role) -> Self {
        Self { name, unit, default, range: (f64::NEG_INFINITY, f64::INFINITY), role }
    }

    /// A factor of the effect; zero by default, of any size and sign.
    pub const fn amplitude(name: &'static str, unit: &'static str) -> Self {
        Self::new(name, unit, 0.0, Role::Amplitude)
    }

    /// A shape of the formula, with its default and the values that a scan tries.
    pub const fn shape(name: &'static str, unit: &'static str, default: f64, tried: &'static [f64]) -> Self {
        Self::new(name, unit, default, Role::Shape(tried))
    }

    /// A frequency, with its default.
    pub const fn frequency(name: &'static str, unit: &'static str, default: f64) -> Self {
        Self::new(name, unit, default, Role::Frequency)
    }

    /// A number that a scan searches, with its meaning and its default.
    pub const fn scanned(name: &'static str, unit: &'static str, default: f64, what: &'static str) -> Self {
        Self::new(name, unit, default, Role::Scanned(what))
    }

    /// The same with a physical range.
    pub const fn within(mut self, low: f64, high: f64) -> Self {
        self.range = (low, high);
        self
    }
}

/// The description of an effect in addition to its formula.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spec {
    /// The name used in code: `udd.effects.<name>`.
    pub name: &'static str,
    /// The name used in prose.
    pub title: &'static str,
    /// The formula as a reader writes it.
    pub equation: &'static str,
    /// Its physical meaning, in a sentence.
    pub meaning: &'static str,
    /// The bodies that it can act on.
    pub bodies: &'static [Body],
    /// The slots that it enters.
    pub slots: &'static [Slot],
    /// How it may enter the angular momentum, the default first; empty for torque and friction.
    pub momenta: &'static [Momentum],
    pub parameters: &'static [EffectParameter],
}

/// A physical effect: its description and its law.
pub trait EffectLaw {
    const SPEC: Spec;
    /// True if it is dry friction, which can be [treated](FrictionModel) in several ways.
    const DRY: bool = false;

    /// Adds the effect, with parameters `p` in the order of the spec, to its slots.
    fn enter<S: Scalar>(p: &[S], at: &EffectInputs<S>, slots: &mut Contributions<S>);
}

/// An effect over one kind of number: a function of its own, not a part of each that has effects.
#[inline(never)]
fn enter<L: EffectLaw, S: Scalar>(p: &[S], at: &EffectInputs<S>, slots: &mut Contributions<S>) {
    L::enter(p, at, slots);
}

/// The most parameters an effect of the library can have.
const MAX_PARAMETERS: usize = 4;

macro_rules! library {
    ($($module:ident :: $Name:ident),+ $(,)?) => {
        $(pub use $module::$Name;)+

        // Else a model with the effect could not be built.
        const _: () = { $(assert!($Name::SPEC.parameters.len() <= MAX_PARAMETERS);)+ };

        /// The effects in the library.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub enum Kind { $($Name),+ }

        impl Kind {
            /// Every effect in the library.
            pub const ALL: &[Kind] = &[$(Kind::$Name),+];

            /// Its description in addition to its formula.
            pub fn spec(self) -> &'static Spec {
                match self { $(Kind::$Name => &$Name::SPEC),+ }
            }

            /// Returns true if it is dry friction, which can be [treated](FrictionModel) in several ways.
            pub fn dry(self) -> bool {
                match self { $(Kind::$Name => $Name::DRY),+ }
            }

            fn enter<S: Scalar>(self, p: &[S], at: &EffectInputs<S>, slots: &mut Contributions<S>) {
                match self { $(Kind::$Name => enter::<$Name, S>(p, at, slots)),+ }
            }

            /// The same for what moves the contact alone; the others are not compiled.
            fn slip<S: Scalar>(self, p: &[S], at: &EffectInputs<S>, slots: &mut Contributions<S>) {
                match self {
                    $(Kind::$Name => {
                        if const { !$Name::SPEC.momenta.is_empty() } {
                            enter::<$Name, S>(p, at, slots);
                        }
                    }),+
                }
            }
        }
    };
}

library! {
    quadratic_drag::QuadraticDrag,
    cubic_drag::CubicDrag,
    coulomb::Coulomb,
    stribeck::Stribeck,
    relaxation::Relaxation,
    slip::Slip,
    radial_slip::RadialSlip,
    load_drive::LoadDrive,
    load_friction::LoadFriction,
    lateral_slip::LateralSlip,
    wheel_ripple::WheelRipple,
    drive_ripple::DriveRipple,
    drive_drift::DriveDrift,
    tilt::Tilt,
    eccentric_mass::EccentricMass,
    uneven_disk::UnevenDisk,
    cable_torque::CableTorque,
    constant_torque::ConstantTorque,
    radial_friction::RadialFriction,
    power_drag::PowerDrag,
    threshold_drag::ThresholdDrag,
    load_coulomb::LoadCoulomb,
    warming_friction::WarmingFriction,
    local_brake::LocalBrake,
}
