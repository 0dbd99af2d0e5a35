//! The effects of a model, and their numbers.

use std::sync::Arc;

use super::{
    Body, Contributions, EffectInputs, Formula, FrictionModel, Kind, MAX_PARAMETERS, Momentum, Slot,
};
use crate::model::{Parameter, parameter};
use crate::scalar::{Scalar, vector};

/// The source of an effect's law.
#[derive(Clone, Debug, PartialEq)]
pub enum Source {
    Library(Kind),
    /// A user's own.
    Formula(Arc<Formula>),
}

/// An effect that a model has, its numbers left open.
#[derive(Clone, Debug, PartialEq)]
pub struct Effect {
    pub source: Source,
    /// `None` for an effect that enters through torque or friction.
    pub momentum: Option<Momentum>,
    /// [`FrictionModel::Smoothed`] for all but dry friction, which has the choice.
    pub treatment: FrictionModel,
}

impl Effect {
    /// The effect, entering as is usual for it.
    pub fn new(kind: Kind) -> Self {
        let momentum = kind.spec().momenta.first().copied();
        Self { source: Source::Library(kind), momentum, treatment: FrictionModel::Smoothed }
    }

    /// A user's own, entering with the exact equation where it moves the contact.
    pub fn formula(formula: Arc<Formula>) -> Self {
        let velocity = matches!(formula.slot(), Slot::Lateral | Slot::Vertical);
        let momentum = velocity.then_some(Momentum::Consistent);
        Self { source: Source::Formula(formula), momentum, treatment: FrictionModel::Smoothed }
    }

    /// Entering the angular momentum this way.
    pub fn with_momentum(self, momentum: Option<Momentum>) -> Self {
        Self { momentum, ..self }
    }

    /// Treating dry friction this way.
    pub fn with_treatment(self, treatment: FrictionModel) -> Self {
        Self { treatment, ..self }
    }

    /// Which of the library it is, if it is.
    pub fn kind(&self) -> Option<Kind> {
        match self.source {
            Source::Library(kind) => Some(kind),
            Source::Formula(_) => None,
        }
    }

    /// Its name among a model's effects.
    pub fn name(&self) -> &str {
        match &self.source {
            Source::Library(kind) => kind.spec().name,
            Source::Formula(formula) => formula.name(),
        }
    }

    /// The bodies that it can act on.
    pub fn bodies(&self) -> &[Body] {
        match &self.source {
            Source::Library(kind) => kind.spec().bodies,
            Source::Formula(formula) => formula.bodies(),
        }
    }

    /// Its parameters, called `effect.name`.
    pub fn parameters(&self) -> Vec<Parameter> {
        let called = |own: &str, unit| parameter(&format!("{}.{own}", self.name()), unit);
        match &self.source {
            Source::Library(kind) => kind.spec().parameters.iter().map(|p| called(p.name, p.unit)).collect(),
            Source::Formula(formula) => formula.parameters().iter().map(|own| called(own, "")).collect(),
        }
    }
}

/// A law with its numbers.
#[derive(Clone, Debug)]
enum ValuedLaw<S> {
    Library(Kind, [S; MAX_PARAMETERS]),
    /// With what its parameters determine.
    Formula(Arc<Formula>, Vec<S>),
}

/// An effect with its numbers.
#[derive(Clone, Debug)]
pub struct Term<S> {
    law: ValuedLaw<S>,
    pub momentum: Option<Momentum>,
    pub treatment: FrictionModel,
}

impl<S: Scalar> Term<S> {
    /// The same law with its numbers changed.
    pub fn map<T: Scalar>(&self, number: impl Fn(S) -> T) -> Term<T> {
        let law = match &self.law {
            ValuedLaw::Library(kind, values) => ValuedLaw::Library(*kind, values.map(number)),
            ValuedLaw::Formula(formula, fixed) => {
                ValuedLaw::Formula(formula.clone(), fixed.iter().map(|&value| number(value)).collect())
            }
        };
        Term { law, momentum: self.momentum, treatment: self.treatment }
    }

    /// The effects with their values taken one after the other from `values`.
    pub fn list(effects: &[Effect], mut values: &[S]) -> Vec<Self> {
        let mut terms = Vec::with_capacity(effects.len());
        for &Effect { ref source, momentum, treatment } in effects {
            let (count, law): (usize, _) = match source {
                Source::Library(kind) => {
                    let count = kind.spec().parameters.len();
                    let mut padded = [S::zero(); MAX_PARAMETERS];
                    padded[..count].copy_from_slice(&values[..count]);
                    (count, ValuedLaw::Library(*kind, padded))
                }
                Source::Formula(formula) => {
                    let count = formula.parameters().len();
                    (count, ValuedLaw::Formula(formula.clone(), formula.fix(&values[..count])))
                }
            };
            terms.push(Term { law, momentum, treatment });
            values = &values[count..];
        }
        terms
    }

    /// Adds the effect to its slots, over the model's scalar or over duals of it.
    #[inline]
    pub fn enter<A: Scalar>(
        &self,
        lift: &impl Fn(S) -> A,
        at: &EffectInputs<A>,
        slots: &mut Contributions<A>,
    ) {
        slots.treatment = self.treatment;
        match &self.law {
            ValuedLaw::Library(kind, values) => {
                kind.enter(&vector!(A, MAX_PARAMETERS; i => lift(values[i])), at, slots)
            }
            ValuedLaw::Formula(formula, fixed) => formula.enter(fixed, lift, at, slots),
        }
    }

    /// The same of an effect that moves the contact.
    #[inline]
    pub fn slip<A: Scalar>(
        &self,
        lift: &impl Fn(S) -> A,
        at: &EffectInputs<A>,
        slots: &mut Contributions<A>,
    ) {
        match &self.law {
            ValuedLaw::Library(kind, values) => {
                kind.slip(&vector!(A, MAX_PARAMETERS; i => lift(values[i])), at, slots)
            }
            ValuedLaw::Formula(formula, fixed) => formula.enter(fixed, lift, at, slots),
        }
    }

    /// Returns true if it holds a body at rest.
    pub fn sticks(&self) -> bool {
        matches!(self.treatment, FrictionModel::SetValued | FrictionModel::Karnopp)
    }

    /// Returns true if it treats slow sliding as rest.
    pub fn has_band(&self) -> bool {
        self.treatment == FrictionModel::Karnopp
    }
}
