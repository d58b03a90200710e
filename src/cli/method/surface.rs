//! The surface that fair curves lie in.

use std::str::FromStr;
use std::sync::Arc;

use clap::Args;
use faircurve::discrete::Pins;
use faircurve::io::surfaces::{is_file, surface_of};
use faircurve::spline::SurfaceSpline;
use faircurve::surface::{Surface, named};
use faircurve::{Error, Result};

use super::{MethodArgs, MethodName};

/// A surface by its word and its sizes. Those of files are read when everything else has been
/// checked.
#[derive(Clone, Debug)]
struct Word {
    text: String,
    surface: Option<Arc<dyn Surface>>,
}

impl FromStr for Word {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let surface = if is_file(text) { None } else { Some(surface_of(text)?) };
        Ok(Word { text: text.into(), surface })
    }
}

#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Curves in a surface")]
pub struct SurfaceArgs {
    /// Fits fair curves in a surface: sphere, wgs84, ellipsoid:a,b,c, spheroid:a,b, torus:R,r,
    /// cylinder:R, cone:degrees, grid:FILE, mesh:FILE.obj
    ///
    /// On sphere and wgs84 x and y are longitudes and latitudes in degrees, and lengths are in
    /// metres. No curve tears at the date line or at a pole. The others take points in space. Their
    /// axis is along z, through 0.
    ///
    /// grid:FILE is the terrain over a grid of heights, as the command grid reads them from CSV and
    /// NPZ, where x is the column and y the row. grid:FILE,D has nodes D apart, grid:FILE,DX,DY
    /// columns and rows (DY below 0 from north to south), and grid:FILE,DX,DY,X0,Y0 column 0 of row
    /// 0 at X0, Y0.
    ///
    /// mesh:FILE.obj is a smooth surface through the vertices of triangles.
    #[arg(long, value_name = "SURFACE")]
    surface: Option<Word>,
    /// The radius of --surface sphere [default: 6371008.7714, of the Earth in metres]
    #[arg(long, value_name = "R", requires = "surface", allow_negative_numbers = true)]
    radius: Option<f64>,
    /// The largest distance of a point from its surface, onto which it is moved [default: 0.001 of
    /// the curve's size]
    #[arg(long, value_name = "D", requires = "surface", allow_negative_numbers = true)]
    off_surface: Option<f64>,
}

impl SurfaceArgs {
    /// Whether a surface is given.
    pub fn is_given(&self) -> bool {
        self.surface.is_some()
    }

    /// Whether its points are longitudes and latitudes.
    pub fn is_globe(&self) -> bool {
        self.surface.as_ref().and_then(|word| word.surface.as_ref()?.kind().globe()).is_some()
    }

    /// The ellipsoid of the Earth.
    pub fn wgs84() -> Self {
        let surface = "wgs84".parse().expect("a word of a surface");
        SurfaceArgs { surface: Some(surface), radius: None, off_surface: None }
    }

    /// Whether it is a globe in metres.
    pub fn is_earth(&self) -> bool {
        self.is_globe() && self.radius.is_none()
    }

    /// The words of a caption.
    pub fn title(&self) -> Option<String> {
        let name = |word: &Word| word.surface.as_ref().map_or(word.text.clone(), |surface| surface.name());
        self.surface.as_ref().map(|word| format!("in {}", name(word)))
    }

    /// The surface.
    ///
    /// # Errors
    /// A radius that is not a positive number, or of another surface. A file that cannot be read or makes no
    /// surface.
    pub fn surface(&self) -> Result<Option<Arc<dyn Surface>>> {
        match (&self.surface, self.radius) {
            (None, _) => Ok(None),
            (Some(word), None) => word.surface.clone().map_or_else(|| surface_of(&word.text), Ok).map(Some),
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

impl MethodArgs {
    /// Natural and smoothing splines in a surface.
    pub(super) fn in_surface(&self) -> Result<SurfaceSpline> {
        let surface = self.surface.surface()?.expect("a surface is given");
        let smoothing = match self.name() {
            MethodName::Natural => {
                self.refuse_distance("natural splines")?;
                None
            }
            _ => Some(self.smoothing_target()?),
        };
        Ok(SurfaceSpline {
            smoothing,
            heights: self.heights(),
            off_surface: self.surface.off_surface(),
            pin_ends: self.pin != Some(Pins::None),
            parametrisation: self.parametrisation.unwrap_or_default(),
            ..SurfaceSpline::new(surface)
        })
    }
}
