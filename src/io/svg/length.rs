//! Lengths with units, and the viewport that percentages refer to.

use roxmltree::Node;
use svgtypes::{Length, LengthUnit, ViewBox};

use crate::deviation::PIXEL;
use crate::error::quoted;

/// Width and height of the nearest `<svg>`, in units of the drawing, where they are known.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Viewport([Option<f64>; 2]);

impl Viewport {
    /// The viewport that an `<svg>` makes in another.
    pub fn of(svg: Node, outer: Self) -> Self {
        if let Some(Ok(ViewBox { w, h, .. })) = svg.attribute("viewBox").map(str::parse) {
            return Viewport([Some(w), Some(h)]);
        }
        let side = |k: usize| match length(svg, ["width", "height"][k], outer) {
            Ok(given) => given.or(outer.0[k]),
            Err(_) => None,
        };
        Viewport([side(0), side(1)])
    }

    /// The length that is 100% for an attribute.
    fn whole(self, attribute: &str) -> Option<f64> {
        let [width, height] = self.0;
        match attribute {
            "r" => Some((0.5 * (width?.powi(2) + height?.powi(2))).sqrt()),
            "y" | "y1" | "y2" | "cy" | "ry" | "height" => height,
            _ => width,
        }
    }
}

/// Metres in a unit of a drawing: of a pixel, unless a `viewBox` scales it to the size of the drawing.
pub(super) fn unit(svg: Node) -> f64 {
    let Some(Ok(ViewBox { w, h, .. })) = svg.attribute("viewBox").map(str::parse) else { return PIXEL };
    let side = |name: &str, units: f64| Some(length(svg, name, Viewport::default()).ok()?? / units);
    let scale = [side("width", w), side("height", h)].into_iter().flatten().filter(|scale| scale.is_normal());
    PIXEL * scale.reduce(f64::min).unwrap_or(1.0)
}

/// A length in units of the drawing, or what is wrong with it. `None` where none is given.
pub(super) fn length(node: Node, name: &str, viewport: Viewport) -> Result<Option<f64>, String> {
    let Some(text) = node.attribute(name).map(str::trim).filter(|text| !text.is_empty() && *text != "auto") else {
        return Ok(None);
    };
    let wrong = |remedy: &str| Err(format!("{name} is {}: {remedy}", quoted(text)));
    let Ok(Length { number, unit }) = text.to_ascii_lowercase().parse() else {
        return wrong("give a number, or a length in px, mm, cm, in, pt, pc or %");
    };
    // An inch has 96 units.
    let unit = match unit {
        LengthUnit::None | LengthUnit::Px => 1.0,
        LengthUnit::In => 96.0,
        LengthUnit::Cm => 96.0 / 2.54,
        LengthUnit::Mm => 96.0 / 25.4,
        LengthUnit::Pt => 96.0 / 72.0,
        LengthUnit::Pc => 16.0,
        LengthUnit::Em | LengthUnit::Ex => return wrong("sizes of fonts are not read: give it in px"),
        LengthUnit::Percent => match viewport.whole(name) {
            Some(whole) => 0.01 * whole,
            None => return wrong("the drawing has no size that this is a part of: give it in px, or <svg> a viewBox"),
        },
    };
    Ok(Some(number * unit))
}
