//! The surface that fair curves lie in.

use std::str::FromStr;
use std::sync::Arc;

use clap::Args;
use faircurve::surface::{Surface, named};
use faircurve::{Error, Result};

/// A surface by its word and its sizes.
#[derive(Clone, Debug)]
struct Word {
    text: String,
    surface: Arc<dyn Surface>,
}

impl FromStr for Word {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        Ok(Word { text: text.into(), surface: named(text)? })
    }
}

#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Curves in a surface")]
pub struct SurfaceArgs {
    /// Fits fair curves in a surface: sphere, wgs84, ellipsoid:a,b,c, spheroid:a,b, torus:R,r, cylinder:R, cone:degrees
    ///
    /// On sphere and wgs84 x and y are longitudes and latitudes in degrees, and lengths are in metres. No curve tears at the
    /// date line or at a pole. The others take points in space. Their axis is along z, through 0.
    #[arg(long, value_name = "SURFACE")]
    surface: Option<Word>,
    /// The radius of --surface sphere [default: 6371008.7714, of the Earth in metres]
    #[arg(long, value_name = "R", requires = "surface", allow_negative_numbers = true)]
    radius: Option<f64>,
    /// The largest distance of a point from its surface, onto which it is moved [default: 0.001 of the curve's size]
    #[arg(long, value_name = "D", requires = "surface", allow_negative_numbers = true)]
    off_surface: Option<f64>,
}

impl SurfaceArgs {
    /// Whether a surface is given.
    pub fn is_given(&self) -> bool {
        self.surface.is_some()
    }

    /// The words of a caption, after a comma.
    pub fn title(&self) -> String {
        self.surface.as_ref().map_or(String::new(), |word| format!(", in {}", word.surface.name()))
    }

    /// The surface.
    ///
    /// # Errors
    /// A radius that is none, or of another surface.
    pub fn surface(&self) -> Result<Option<Arc<dyn Surface>>> {
        match (&self.surface, self.radius) {
            (None, _) => Ok(None),
            (Some(word), None) => Ok(Some(word.surface.clone())),
            (Some(word), Some(radius)) if word.text == "sphere" => named(&format!("sphere:{radius}")).map(Some),
            (Some(word), Some(radius)) => {
                Err(Error::Argument(format!("--radius {radius} is that of --surface sphere, and not of {}", word.text)))
            }
        }
    }

    /// The largest distance of a point from the surface.
    pub fn off_surface(&self) -> Option<f64> {
        self.off_surface
    }
}
