//! From the picture to the plane of the disk, for a lens that bends and a camera that looks askance.

use nalgebra::Complex;

use super::coverage::Local;

/// The map from the picture to the plane, both in pixels. With p the picture point from `middle` in units of
/// `size`: q = p (1 + curve |p|^2), w = q / (1 + tilt_u q_u + tilt_v q_v), then u is stretched by
/// 1 + aspect and v sheared by `shear`.
#[derive(Clone, Copy, Debug)]
pub struct Lens {
    pub middle: [f64; 2],
    pub size: f64,
    pub curve: f64,
    pub tilt: [f64; 2],
    pub aspect: f64,
    pub shear: f64,
}

const CONTRACTIONS: usize = 8; // by 3 curve |p|^2 a time

impl Lens {
    /// Whether the map changes nothing.
    pub fn plain(&self) -> bool {
        self.curve == 0.0 && self.tilt == [0.0; 2] && self.aspect == 0.0 && self.shear == 0.0
    }

    fn middle(&self) -> Complex<f64> {
        Complex::new(self.middle[0], self.middle[1])
    }

    /// The point of the plane for one of the picture.
    pub fn plane(&self, picture: Complex<f64>) -> Complex<f64> {
        if self.plain() {
            return picture;
        }
        let p = (picture - self.middle()) / self.size;
        let q = p * (1.0 + self.curve * p.norm_sqr());
        let w = q / (1.0 + self.tilt[0] * q.re + self.tilt[1] * q.im);
        self.middle() + Complex::new(w.re * (1.0 + self.aspect), w.im + self.shear * w.re) * self.size
    }

    /// The point of the picture for one of the plane.
    pub fn picture(&self, plane: Complex<f64>) -> Complex<f64> {
        if self.plain() {
            return plane;
        }
        let w = (plane - self.middle()) / self.size;
        let across = w.re / (1.0 + self.aspect);
        let w = Complex::new(across, w.im - self.shear * across);
        let q = w / (1.0 - self.tilt[0] * w.re - self.tilt[1] * w.im);
        let mut p = q;
        for _ in 0..CONTRACTIONS {
            p = q / (1.0 + self.curve * p.norm_sqr());
        }
        self.middle() + p * self.size
    }

    /// The map near a point of the plane, linearised.
    pub fn local(&self, plane: Complex<f64>) -> Local {
        let at = self.picture(plane);
        if self.plain() {
            let here = [plane.re, plane.im];
            return Local { picture: here, plane: here, slope: [1.0, 0.0, 0.0, 1.0] };
        }
        let h = 0.5;
        let (along, down) = (Complex::new(h, 0.0), Complex::new(0.0, h));
        let du = (self.plane(at + along) - self.plane(at - along)) / (2.0 * h);
        let dv = (self.plane(at + down) - self.plane(at - down)) / (2.0 * h);
        let here = self.plane(at);
        Local { picture: [at.re, at.im], plane: [here.re, here.im], slope: [du.re, dv.re, du.im, dv.im] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_and_back() {
        let lens = Lens {
            middle: [275.0, 350.0],
            size: 445.0,
            curve: 0.03,
            tilt: [0.1, -0.05],
            aspect: 0.02,
            shear: 0.01,
        };
        let at = Complex::new(410.0, 220.0);
        // eight contractions by 3 * 0.03 * 0.15 a time leave nothing of a picture's width
        assert!((lens.picture(lens.plane(at)) - at).norm() < 1e-9);
        let local = lens.local(lens.plane(at));
        let near = lens.plane(at + Complex::new(0.3, -0.2));
        let back = local.back([near.re, near.im]);
        // the map bends by about 1e-4 per pixel
        assert!((back[0] - at.re - 0.3).hypot(back[1] - at.im + 0.2) < 1e-4);
    }
}
