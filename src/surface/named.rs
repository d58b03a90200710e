//! Surfaces by their words and sizes, such as torus:2,1.

use std::sync::Arc;

use glam::DVec3;

use super::{Globe, Quadric, Surface, Torus};
use crate::error::{Error, Result};

/// The words of surfaces, with the sizes that each takes. A sphere without any is the Earth.
const KINDS: [(&str, &[&str]); 7] = [
    ("sphere", &["R"]),
    ("wgs84", &[]),
    ("ellipsoid", &["a", "b", "c"]),
    ("spheroid", &["a", "b"]),
    ("torus", &["R", "r"]),
    ("cylinder", &["R"]),
    ("cone", &["degrees"]),
];

/// Whether a text begins with one of the words.
#[cfg(feature = "formats")]
pub(crate) fn is_named(text: &str) -> bool {
    let word = text.split(':').next();
    KINDS.iter().any(|(own, _)| word == Some(*own))
}

/// The surface of a word and its sizes.
///
/// | word | surface |
/// |---|---|
/// | `sphere`, `sphere:R` | longitudes and latitudes on a sphere, of the Earth's mean radius in metres, or of radius R |
/// | `wgs84` | longitudes and latitudes on the ellipsoid of WGS84, in metres |
/// | `ellipsoid:a,b,c` | (x/a)² + (y/b)² + (z/c)² = 1 |
/// | `spheroid:a,b` | the ellipsoid of semi-axes a, a and b |
/// | `torus:R,r` | the torus around the axis z, R from it to the middle of the tube of radius r |
/// | `cylinder:R` | x² + y² = R² |
/// | `cone:degrees` | the cone of this half angle around the axis z, with its apex at 0 |
///
/// # Errors
/// Another word, other sizes, or sizes that are not positive.
pub fn named(text: &str) -> Result<Arc<dyn Surface>> {
    let refuse = |why: String| Err(Error::Argument(why));
    let (word, rest) = text.split_once(':').unwrap_or((text, ""));
    let form = |(word, sizes): &(&str, &[&str])| match sizes.is_empty() {
        true => word.to_string(),
        false => format!("{word}:{}", sizes.join(",")),
    };
    let Some(kind) = KINDS.iter().find(|(own, _)| *own == word) else {
        let all: Vec<String> = KINDS.iter().map(form).collect();
        return refuse(format!("there is no surface '{word}': use {}", all.join(", ")));
    };
    let parts: Vec<&str> = rest.split(',').map(str::trim).filter(|part| !part.is_empty()).collect();
    if parts.len() != kind.1.len() && text != "sphere" {
        return refuse(format!("'{text}' has not the sizes of its surface: write {}", form(kind)));
    }
    let mut sizes = Vec::new();
    for part in parts {
        match part.parse::<f64>() {
            Ok(size) if size > 0.0 && size.is_finite() => sizes.push(size),
            _ => {
                return refuse(format!(
                    "'{part}' is no size of a surface: give positive numbers, as in {}",
                    form(kind)
                ));
            }
        }
    }
    Ok(match word {
        "sphere" => Arc::new(Globe::sphere(sizes.first().copied().unwrap_or(Globe::EARTH))?),
        "wgs84" => Arc::new(Globe::WGS84),
        "ellipsoid" => Arc::new(Quadric::ellipsoid(DVec3::from_slice(&sizes))),
        "spheroid" => Arc::new(Quadric::spheroid(sizes[0], sizes[1])),
        "torus" => Arc::new(Torus::new(sizes[0], sizes[1])?),
        "cylinder" => Arc::new(Quadric::cylinder(sizes[0])),
        _ if sizes[0] < 90.0 => Arc::new(Quadric::cone(sizes[0].to_radians())),
        _ => return refuse(format!("a cone of half angle {}° is none: give less than 90", sizes[0])),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_word_is_a_surface_and_others_have_a_sentence() {
        for (text, name) in [
            ("sphere", "the sphere of radius 6371008.7714"),
            ("sphere:1", "the sphere of radius 1"),
            ("wgs84", "the ellipsoid of WGS84"),
            ("ellipsoid:3,2,1", "the ellipsoid of semi-axes 3, 2 and 1"),
            ("spheroid: 1, 2", "the spheroid of semi-axes 1 and 2"),
            ("torus:2,1", "the torus of radii 2 and 1"),
            ("cylinder:0.5", "the cylinder of radius 0.5"),
            ("cone:30", "the cone of half angle 0.5235987755982988"),
        ] {
            assert_eq!(named(text).unwrap().name(), name);
        }
        for (text, what) in [
            ("ball", "there is no surface 'ball': use sphere:R, wgs84, ellipsoid:a,b,c"),
            ("torus:2", "write torus:R,r"),
            ("torus:1,2", "meets itself"),
            ("sphere:-1", "'-1' is no size"),
            ("wgs84:1", "write wgs84"),
            ("cone:90", "give less than 90"),
        ] {
            let error = named(text).unwrap_err().to_string();
            assert!(error.contains(what), "{error}");
        }
    }
}
