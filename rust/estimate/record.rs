//! The measured record and the unknowns.

use nalgebra::{SMatrix, SVector};

/// What was seen, frame by frame.
#[derive(Clone, Debug)]
pub struct Record<const M: usize> {
    /// Time of each frame, s, increasing.
    pub t: Vec<f64>,
    /// What was seen; any number where the information is zero.
    pub seen: Vec<SVector<f64, M>>,
    /// The inverse covariance of the noise; zero where a channel was not seen.
    pub information: Vec<SMatrix<f64, M, M>>,
    /// Whether frame `i + 1` continues the motion of frame `i`; false where a new run starts.
    pub linked: Vec<bool>,
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
pub struct Free {
    pub role: Role,
    pub mean: f64,
    /// Standard deviation of the prior; infinite for none.
    pub sd: f64,
}

/// A value of all unknowns.
#[derive(Clone, Debug)]
pub struct Point<const D: usize> {
    /// The state at every frame.
    pub states: Vec<[f64; D]>,
    /// The model's parameters, free or not.
    pub model: Vec<f64>,
    /// The camera's parameters, free or not.
    pub camera: Vec<f64>,
    /// The relative error of the clock.
    pub clock: f64,
}

impl<const D: usize> Point<D> {
    /// The value of a parameter.
    pub fn get(&self, role: Role) -> f64 {
        match role {
            Role::Model(j) => self.model[j],
            Role::Camera(j) => self.camera[j],
            Role::Clock => self.clock,
        }
    }

    /// A reference to the value of a parameter.
    pub fn get_mut(&mut self, role: Role) -> &mut f64 {
        match role {
            Role::Model(j) => &mut self.model[j],
            Role::Camera(j) => &mut self.camera[j],
            Role::Clock => &mut self.clock,
        }
    }
}
