//! Figures: panels of curves, and plots below them.

mod plot;

use std::io::{self, Write};

use faircurve::picture::drawing::{self, Bar, Below, GAP, SIDE, VALUES, column, mix};
pub(crate) use faircurve::picture::drawing::{Panel, Stroke, thousands};
use glam::DVec2;
pub(crate) use plot::{Axis, Plot, Series};

/// A colour in sRGB.
type Colour = [u8; 3];

/// An evolution begins in black and ends in red. Curves between go from blue to red.
const FIRST: Colour = [0, 0, 0];
const EARLY: Colour = [31, 79, 224];
const LAST: Colour = [208, 0, 0];

/// The most that segments of a fan may swing out, in chords.
const SWING: f64 = 2.0;

/// Several panels in rows of `columns`, and below them [`Plot`]s.
///
/// Panels of a row have one scale and one size, so that their curves can be compared.
#[derive(Clone, Debug)]
pub(crate) struct Sheet {
    /// Width in pixels. The height follows from what is drawn.
    pub width: f64,
    /// Panels a row.
    pub columns: usize,
    /// A line above all panels.
    pub title: Option<String>,
    /// Text below the legend.
    pub caption: String,
    /// The panels, row by row.
    pub panels: Vec<Panel>,
    /// The plots. A single one is as wide as the page. Several stand side by side as the panels do.
    pub plots: Vec<Plot>,
}

impl Default for Sheet {
    fn default() -> Self {
        Sheet { width: 1000.0, columns: 2, title: None, caption: String::new(), panels: Vec::new(), plots: Vec::new() }
    }
}

impl Sheet {
    /// The sheet as SVG text.
    pub fn draw(self) -> String {
        let Sheet { width, columns, title, caption, panels, plots } = self;
        let sheet = drawing::Sheet { width, columns, title, caption, panels };
        let across = columns.clamp(1, plots.len().max(1));
        let mut out = Vec::new();
        sheet.write(&mut out, &Plots { plots, across }).expect("a Vec takes all that is written to it");
        String::from_utf8(out).expect("written from strings")
    }
}

/// Plots in rows.
struct Plots {
    plots: Vec<Plot>,
    across: usize,
}

impl Plots {
    /// The rows with the place of their tops below the first, and the height of all.
    fn rows(&self) -> (Vec<(f64, &[Plot])>, f64) {
        let (mut rows, mut y) = (Vec::new(), 0.0);
        for row in self.plots.chunks(self.across) {
            rows.push((y, row));
            y += row.iter().map(Plot::height).fold(0.0, f64::max) + GAP;
        }
        (rows, (y - GAP).max(0.0))
    }
}

impl Below for Plots {
    fn height(&self, _: f64) -> f64 {
        self.rows().1
    }

    fn write(&self, out: &mut dyn Write, width: f64, top: f64) -> io::Result<()> {
        let wide = column(width, self.across);
        for (y, row) in self.rows().0 {
            for (k, plot) in row.iter().enumerate() {
                let left = SIDE + k as f64 * (wide + GAP);
                plot.write(out, [left, left + wide], top + y)?;
            }
        }
        Ok(())
    }
}

/// A page with the [evolution](panel_of_evolution) of one curve.
pub(crate) fn evolution(title: &str, caption: String, dots: &[DVec2], curves: &[Vec<DVec2>]) -> String {
    let panels = vec![panel_of_evolution("", dots, curves)];
    Sheet { title: Some(title.into()), caption, width: 900.0, columns: 1, panels, plots: Vec::new() }.draw()
}

/// How an iteration changed a planar curve.
///
/// The first curve is black and the last is red, both bold. Those between are thin and go from
/// blue to red. A single curve counts as the last. Curves are cut off at a third of the dots'
/// size away.
pub(crate) fn panel_of_evolution(title: impl Into<String>, dots: &[DVec2], curves: &[Vec<DVec2>]) -> Panel {
    let between = curves.len().saturating_sub(2);
    let stroke = |(k, points): (usize, &Vec<DVec2>)| {
        let (colour, width, name) = if k + 1 == curves.len() {
            (LAST, 2.0, Some("last curve"))
        } else if k == 0 {
            (FIRST, 1.8, Some("first curve"))
        } else {
            let part = (k - 1) as f64 / between.saturating_sub(1).max(1) as f64;
            let name = match k {
                1 => Some("early iterations"),
                _ if k == between => Some("late iterations"),
                _ => None,
            };
            (mix(&[EARLY, LAST], part), 0.7, name)
        };
        Stroke { points: points.clone(), colour, width, name: name.map(String::from) }
    };
    let strokes = curves.iter().enumerate().map(stroke).collect();
    Panel { title: title.into(), strokes, dots: dots.to_vec(), ..Panel::default() }
}

/// Segments that share their first point and their last.
///
/// Each comes with its end angle in radians, which gives its colour. The two points are marked.
/// Segments are cut off two chords away. A segment whose angle is not finite is left out.
pub(crate) fn panel_of_fan(title: impl Into<String>, segments: &[(f64, Vec<DVec2>)]) -> Panel {
    let angles = segments.iter().map(|segment| segment.0).filter(|angle| angle.is_finite());
    let (from, to) = angles.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), angle| (a.min(angle), b.max(angle)));
    let drawn = || segments.iter().filter(|segment| segment.0.is_finite());
    let stroke = |(angle, points): &(f64, Vec<DVec2>)| {
        let part = if to > from { (angle - from) / (to - from) } else { 0.0 };
        Stroke { points: points.clone(), colour: mix(&VALUES, part), width: 1.1, name: None }
    };
    let ends = drawn().next().and_then(|(_, points)| Some(vec![*points.first()?, *points.last()?]));
    let bar = (to >= from).then(|| Bar {
        text: "end angle".into(),
        from: from.to_degrees(),
        to: to.to_degrees(),
        unit: "°".into(),
        colours: VALUES.to_vec(),
    });
    let strokes = drawn().map(stroke).collect();
    Panel { title: title.into(), strokes, dots: ends.unwrap_or_default(), room: SWING, bar }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{PI, TAU};

    use roxmltree::{Document, Node};

    use super::*;

    /// A sine wave from (0, 0) to (`length`, 0).
    fn sine(length: f64, height: f64) -> Vec<DVec2> {
        (0..=60).map(|k| f64::from(k) / 60.0).map(|t| DVec2::new(length * t, height * (TAU * t).sin())).collect()
    }

    /// A cubic from (0, 0) to (1, 0) that ends in direction `angle`.
    fn segment(angle: f64) -> (f64, Vec<DVec2>) {
        let (out, back) = (DVec2::from_angle(0.6), DVec2::from_angle(angle));
        let at = |t: f64| {
            out * (t * (1.0 - t) * (1.0 - t)) + DVec2::X * (t * t * (3.0 - 2.0 * t)) - back * (t * t * (1.0 - t))
        };
        (angle, (0..=40).map(|k| at(f64::from(k) / 40.0)).collect())
    }

    fn waves(length: f64) -> Panel {
        let curves: Vec<_> = (0..12).map(|k| sine(length, 0.2 * length * 0.8f64.powi(k))).collect();
        panel_of_evolution(format!("a wave {length} long"), &[DVec2::ZERO, DVec2::X * length], &curves)
    }

    fn cost(name: &str, rate: f64) -> Series {
        Series {
            name: name.into(),
            points: (0..=40).map(f64::from).map(|k| DVec2::new(k, 0.3 + 0.7 * rate.powf(k))).collect(),
        }
    }

    fn demonstration() -> Sheet {
        let fan: Vec<_> = (-10..=10).map(|k| segment(f64::from(k) * PI / 11.0)).collect();
        let plot = |y| Plot {
            title: "How the <cost> falls".into(),
            x: Axis::linear("iteration"),
            y,
            series: vec![cost("wave", 0.8), cost("octopus & co.", 0.95)],
        };
        Sheet {
            title: Some("Sines".into()),
            caption: "each panel of a row has the same scale".into(),
            panels: vec![waves(2.0), waves(4.0), panel_of_fan("cubics by end angle", &fan)],
            plots: vec![plot(Axis::linear("cost / first cost")), plot(Axis::log("cost / first cost"))],
            ..Sheet::default()
        }
    }

    fn all<'a>(document: &'a Document, class: &str) -> Vec<Node<'a, 'a>> {
        document.descendants().filter(|n| n.attribute("class") == Some(class)).collect()
    }

    fn texts(document: &Document) -> Vec<String> {
        document.descendants().filter(|n| n.has_tag_name("text")).filter_map(|n| n.text()).map(String::from).collect()
    }

    fn checked(sheet: &Sheet) -> String {
        let svg = sheet.clone().draw();
        let document = Document::parse(&svg).unwrap();
        for value in document.descendants().flat_map(|n| n.attributes()).map(|a| a.value()) {
            assert!(value.starts_with("system-ui") || !(value.contains("NaN") || value.contains("inf")), "{value}");
        }
        svg
    }

    #[test]
    fn every_panel_and_every_plot_is_there_with_its_words() {
        let svg = checked(&demonstration());
        let document = Document::parse(&svg).unwrap();
        let panels = all(&document, "panel");
        let drawn: Vec<usize> =
            panels.iter().map(|p| p.children().filter(|n| n.attribute("class") == Some("s")).count()).collect();
        assert_eq!(drawn, [12, 12, 21]);
        assert!(all(&document, "dots").iter().all(|dots| dots.attribute("d").unwrap().matches("h0").count() == 2));
        assert_eq!((all(&document, "plot").len(), all(&document, "series").len()), (2, 4));
        let texts = texts(&document);
        let once = [
            "Sines",
            "a wave 2 long",
            "a wave 4 long",
            "cubics by end angle",
            "first curve",
            "early iterations",
            "late iterations",
            "last curve",
            "end angle -164°",
            "164°",
            "each panel of a row has the same scale",
        ];
        for word in once {
            assert_eq!(texts.iter().filter(|text| *text == word).count(), 1, "{word}: {texts:?}");
        }
        for word in ["How the <cost> falls", "iteration", "cost / first cost", "wave", "octopus & co.", "0.4", "20"] {
            assert!(texts.iter().filter(|text| *text == word).count() >= 2, "{word}: {texts:?}");
        }
    }

    #[test]
    fn all_words_are_on_the_page() {
        let sheet = demonstration();
        let svg = checked(&sheet);
        let document = Document::parse(&svg).unwrap();
        let height: f64 = document.root_element().attribute("height").unwrap().parse().unwrap();
        let lowest = document.descendants().filter(|n| n.has_tag_name("text")).map(|n| n.attribute("y").unwrap());
        assert!(lowest.map(|y| y.parse::<f64>().unwrap()).all(|y| y < height));
    }

    #[test]
    fn nothing_to_draw_and_what_cannot_be_drawn_give_a_valid_sheet() {
        checked(&Sheet::default());
        let bad = [f64::NAN, f64::INFINITY, -f64::INFINITY, 1e300].map(DVec2::splat);
        let plot = |x: Axis, y: Axis, points: Vec<DVec2>| Plot {
            x,
            y,
            series: vec![Series { name: "s".into(), points }],
            ..Plot::default()
        };
        checked(&Sheet {
            width: f64::NAN,
            columns: 0,
            panels: vec![
                Panel::default(),
                panel_of_evolution("dots alone", &[DVec2::ONE], &[]),
                panel_of_evolution("bad", &bad[..3], &[bad.to_vec(), vec![DVec2::ZERO, bad[0], DVec2::ONE]]),
                panel_of_fan("bad", &[(f64::NAN, bad.to_vec()), (1.0, Vec::new())]),
            ],
            plots: vec![
                Plot::default(),
                plot(Axis::log("x"), Axis::log("y"), vec![DVec2::ZERO, -DVec2::ONE, bad[0]]),
                plot(Axis::linear("x"), Axis::log("y"), vec![DVec2::new(1e6, 1.0), DVec2::new(1e6, 1.0)]),
                plot(
                    Axis::linear("x"),
                    Axis::linear("y"),
                    vec![DVec2::new(0.0, 1e300), DVec2::new(1.0, 1.0 + 1e-15), DVec2::ONE],
                ),
            ],
            ..Sheet::default()
        });
    }

    fn line(y: f64) -> Vec<DVec2> {
        vec![DVec2::ZERO, DVec2::new(0.5, y), DVec2::X]
    }

    #[test]
    fn an_evolution_goes_from_bold_black_through_thin_blue_to_bold_red() {
        let curves: Vec<_> = (0..6).map(|k| line(f64::from(k))).collect();
        let panel = panel_of_evolution("sine", &[DVec2::ZERO, DVec2::X], &curves);
        let looks: Vec<_> = panel.strokes.iter().map(|s| (s.colour, s.width > 1.5)).collect();
        let bold = |colour: [u8; 3]| (colour, true);
        let thin = |colour: [u8; 3]| (colour, false);
        assert_eq!(
            looks,
            [
                bold([0x00, 0x00, 0x00]),
                thin([0x1F, 0x4F, 0xE0]),
                thin([0x5A, 0x35, 0x95]),
                thin([0x95, 0x1A, 0x4B]),
                thin([0xD0, 0x00, 0x00]),
                bold([0xD0, 0x00, 0x00])
            ]
        );
        let names: Vec<_> = panel.strokes.iter().filter_map(|s| s.name.as_deref()).collect();
        assert_eq!(names, ["first curve", "early iterations", "late iterations", "last curve"]);
        for few in 0..3 {
            let panel = panel_of_evolution("", &[], &curves[..few]);
            assert_eq!(panel.strokes.len(), few);
            assert!(panel.strokes.last().is_none_or(|s| s.colour == LAST && s.width == 2.0));
        }
    }

    #[test]
    fn a_fan_is_coloured_by_end_angle_whatever_the_order() {
        let angles = [1.0, -1.0, f64::NAN, 0.0];
        let panel = panel_of_fan("fan", &angles.map(|angle| (angle, line(angle))));
        let colours: Vec<_> = panel.strokes.iter().map(|s| s.colour).collect();
        assert_eq!(colours, [VALUES[3], VALUES[0], mix(&VALUES, 0.5)]);
        assert_eq!(panel.dots, [DVec2::ZERO, DVec2::X]);
        let bar = panel.bar.unwrap();
        assert_eq!((bar.from, bar.to), ((-1f64).to_degrees(), 1f64.to_degrees()));
        assert_eq!(panel_of_fan("none", &[]).bar, None);
    }
}
