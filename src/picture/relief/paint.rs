//! Colours of surfaces: tints by height, and Lambert's shading.

use glam::DVec3;

use super::super::panel;

/// A colour, linear in sRGB, 0 to 255.
pub(super) type Colour = DVec3;

/// Light that comes from everywhere.
const AMBIENT: f64 = 0.42;

/// How far the light reaches around edges (a sine). A wide light keeps shades apart there.
const AROUND: f64 = 0.25;

/// The direction of the rest of the light: from the left, the front, above.
const LIGHT: DVec3 = DVec3::new(-0.52, -0.30, 0.80);

/// The light at which a colour is unchanged. More light brightens it towards white.
const PLAIN: f64 = 0.88;

/// A colour of three bytes.
pub(super) fn colour(bytes: [u8; 3]) -> Colour {
    DVec3::from(bytes.map(f64::from))
}

/// The colour as SVG writes it.
pub(super) fn hex(colour: Colour) -> String {
    panel::hex(colour.to_array().map(|c| c.round().clamp(0.0, 255.0) as u8))
}

/// The colour of a surface with this unit normal, which points to the eye.
pub(super) fn shaded(colour: Colour, normal: DVec3) -> Colour {
    let lambert = (normal.dot(LIGHT.normalize()) + AROUND) / (1.0 + AROUND);
    let light = AMBIENT + (1.0 - AMBIENT) * lambert.max(0.0);
    if light <= PLAIN {
        colour * (light / PLAIN)
    } else {
        colour.lerp(Colour::splat(255.0), 0.9 * (light - PLAIN) / (1.0 - PLAIN) * 0.35)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_faces_the_light_is_bright_and_what_turns_away_is_dark() {
        let blue = colour([0, 114, 178]);
        let [lit, level, averted] =
            [LIGHT.normalize(), DVec3::Z, -LIGHT.normalize()].map(|normal| shaded(blue, normal).element_sum());
        assert!(lit > level && level > averted, "{lit} {level} {averted}");
        assert!(lit > blue.element_sum() && averted < 0.6 * blue.element_sum());
        assert_eq!(hex(colour([1, 171, 255]) * 2.0), "#02FFFF");
    }
}
