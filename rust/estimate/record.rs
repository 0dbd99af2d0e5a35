//! The measured record and the unknowns.

use nalgebra::{SMatrix, SVector};

/// A record, frame by frame: one film, or several one after the other.
#[derive(Clone, Debug)]
pub struct Record<const M: usize> {
    /// Time of each frame, s, increasing within a film.
    pub t: Vec<f64>,
    /// The observation; any number if the information is zero.
    pub seen: Vec<SVector<f64, M>>,
    /// The inverse covariance of the noise; zero where a channel was not seen.
    pub information: Vec<SMatrix<f64, M, M>>,
    /// Whether frame `i + 1` continues the motion of frame `i`; false where a new run starts.
    pub linked: Vec<bool>,
    /// Which film each frame belongs to, and so which [`FilmParameters`] of parameters holds.
    pub film: Vec<usize>,
    /// The lag-1 autocorrelation of the noise, per channel.
    pub memory: [f64; M],
}

impl<const M: usize> Default for Record<M> {
    /// Without a frame.
    fn default() -> Self {
        Self {
            t: Vec::new(),
            seen: Vec::new(),
            information: Vec::new(),
            linked: Vec::new(),
            film: Vec::new(),
            memory: [0.0; M],
        }
    }
}

impl<const M: usize> Record<M> {
    /// The correlation of channel `m`'s noise in frame `i` with that of the frame before, if that one was observed:
    /// noise is independent after a gap.
    #[inline(always)]
    pub(super) fn remembered(&self, i: usize, m: usize, seen_before: bool) -> f64 {
        if i > 0 && self.linked[i - 1] && seen_before { self.memory[m] } else { 0.0 }
    }

    /// The frames from `first` to `last`, both included.
    pub(super) fn part(&self, first: usize, last: usize) -> Self {
        Self {
            t: self.t[first..=last].to_vec(),
            seen: self.seen[first..=last].to_vec(),
            information: self.information[first..=last].to_vec(),
            linked: self.linked[first..last].to_vec(),
            film: self.film[first..=last].to_vec(),
            memory: self.memory,
        }
    }
}

/// The part that a parameter plays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// The model's parameter of this number.
    Model(usize),
    /// The camera's parameter of this number.
    Camera(usize),
    /// The relative error of the clock: the model runs over `(1 + value) dt`.
    Clock,
}

/// A free parameter with a Gaussian prior.
#[derive(Clone, Copy, Debug)]
pub struct FreeParameter {
    pub role: Role,
    /// The film that it belongs to; none where all films share it.
    pub film: Option<usize>,
    pub mean: f64,
    /// Standard deviation of the prior; infinite for none.
    pub sd: f64,
    /// The least and the largest value for which the model is defined.
    pub range: (f64, f64),
}

impl FreeParameter {
    /// A parameter that all films share and that may have any value.
    pub fn unlimited(role: Role, mean: f64, sd: f64) -> Self {
        Self { role, film: None, mean, sd, range: (f64::NEG_INFINITY, f64::INFINITY) }
    }

    /// Returns `true` if the model is defined for a value.
    pub fn allows(&self, value: f64) -> bool {
        let (least, largest) = self.range;
        (least..=largest).contains(&value)
    }

    /// Whether frames of this film depend on it.
    pub fn acts_on(&self, film: usize) -> bool {
        self.film.is_none_or(|own| own == film)
    }
}

/// The parameters that hold for one film.
#[derive(Clone, Debug, PartialEq)]
pub struct FilmParameters {
    /// The model's parameters, free or not.
    pub model: Vec<f64>,
    /// The camera's parameters, free or not.
    pub camera: Vec<f64>,
    /// The relative error of the clock.
    pub clock: f64,
}

impl FilmParameters {
    /// The value of a parameter.
    pub fn get(&self, role: Role) -> f64 {
        match role {
            Role::Model(j) => self.model[j],
            Role::Camera(j) => self.camera[j],
            Role::Clock => self.clock,
        }
    }

    fn get_mut(&mut self, role: Role) -> &mut f64 {
        match role {
            Role::Model(j) => &mut self.model[j],
            Role::Camera(j) => &mut self.camera[j],
            Role::Clock => &mut self.clock,
        }
    }

    /// How fast the model's time runs.
    pub(super) fn pace(&self) -> f64 {
        1.0 + self.clock
    }
}

/// A value of all unknowns.
#[derive(Clone, Debug, PartialEq)]
pub struct Unknowns<const D: usize> {
    /// The state at every frame.
    pub states: Vec<[f64; D]>,
    /// The parameters of every film.
    pub sets: Vec<FilmParameters>,
}

impl<const D: usize> Unknowns<D> {
    /// The value of a free parameter.
    pub fn get(&self, free: &FreeParameter) -> f64 {
        self.sets[free.film.unwrap_or(0)].get(free.role)
    }

    /// Changes a free parameter.
    pub fn shift(&mut self, free: &FreeParameter, change: f64) {
        for (film, set) in self.sets.iter_mut().enumerate() {
            if free.acts_on(film) {
                *set.get_mut(free.role) += change;
            }
        }
    }
}
