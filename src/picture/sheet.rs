//! [`Sheet`]: panels side by side, and plots below them, on one page.

use std::io::{self, Write};

use glam::DVec2;

use super::layout::{Bounds, Frame};
use super::page::{Entry, LINE, Page, SIDE, wrap};
use super::panel::{Panel, hex, width};
use super::plot::Plot;
use super::svg::escape;

/// Pixels between neighbours, and between a panel's frame and its content.
const GAP: f64 = 20.0;
const MARGIN: f64 = 18.0;

/// Least and largest height of a panel, as parts of its width.
const LOWEST: f64 = 0.25;
const HIGHEST: f64 = 1.3;

/// Several [`Panel`]s in rows of `columns`, and below them [`Plot`]s.
///
/// The panels share one legend. Panels of a row have one scale and one size, so that their curves
/// can be compared. Each panel has its own middle.
///
/// ```
/// use faircurve::picture::{Axis, Panel, Plot, Series, Sheet};
/// use glam::DVec2;
/// let dots = [DVec2::ZERO, DVec2::new(2.0, 0.0)];
/// let curves = [1.0, 0.5, 0.2].map(|y| vec![dots[0], DVec2::new(1.0, y), dots[1]]);
/// let cost = (0..3).zip([1.0, 0.4, 0.3]).map(|(k, cost)| DVec2::new(f64::from(k), cost)).collect();
/// let svg = Sheet {
///     panels: vec![Panel::evolution("ν = 2", &dots, &curves)],
///     plots: vec![Plot {
///         x: Axis::linear("iteration"),
///         y: Axis::log("cost / first cost"),
///         series: vec![Series { name: "ν = 2".into(), points: cost }],
///         ..Plot::default()
///     }],
///     ..Sheet::default()
/// }
/// .draw();
/// assert!(svg.contains("first curve") && svg.contains("iteration"));
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Sheet {
    /// Width in pixels. The height follows from what is drawn. Default 1000, at least 160.
    pub width: f64,
    /// Panels a row. Default 2. 0 counts as 1.
    pub columns: usize,
    /// A line above all panels. Default none.
    pub title: Option<String>,
    /// Text below the legend. Default empty.
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

/// A panel's title in lines, the place of its first line, and the panel's frame.
struct Placed {
    title: Vec<String>,
    corner: [f64; 2],
    frame: Frame,
}

impl Sheet {
    /// The sheet as SVG text.
    pub fn draw(&self) -> String {
        let mut out = Vec::new();
        self.write(&mut out).expect("a Vec takes all that is written to it");
        String::from_utf8(out).expect("written from strings")
    }

    /// Writes the sheet piece by piece.
    ///
    /// # Errors
    /// Those of `out`.
    pub fn write(&self, out: &mut dyn Write) -> io::Result<()> {
        let width = if self.width.is_nan() { 160.0 } else { self.width.clamp(160.0, 1e5) };
        let columns = self.columns.max(1);
        let mut y = if self.title.is_some() { 44.0 } else { 16.0 };
        let mut placed = Vec::new();
        let wide = column(width, columns.min(self.panels.len().max(1)));
        for row in self.panels.chunks(columns) {
            y = place(row, wide, y, &mut placed) + GAP;
        }
        let across = columns.min(self.plots.len().max(1));
        let wide_plot = column(width, across);
        let mut plots = Vec::new();
        for row in self.plots.chunks(across) {
            plots.extend((0..row.len()).map(|k| (SIDE + k as f64 * (wide_plot + GAP), y)));
            y += row.iter().map(Plot::height).fold(0.0, f64::max) + GAP;
        }

        let bottom = (y - GAP).max(0.0);
        let whole = Frame::inside(Bounds::EMPTY, DVec2::ONE, [0.0, 0.0, width, bottom], 0.0);
        let page = Page { frame: &whole, width, title: self.title.as_deref() };
        page.open(out, &self.legend(), &self.caption)?;
        for (k, (panel, at)) in self.panels.iter().zip(&placed).enumerate() {
            for (line, text) in at.title.iter().enumerate() {
                let [x, y] = at.corner;
                let y = y + LINE * line as f64;
                writeln!(out, r#"<text x="{x:.1}" y="{y:.1}" font-size="13">{}</text>"#, escape(text))?;
            }
            panel.write(out, &at.frame, &format!("panel{k}"))?;
        }
        for (plot, (left, top)) in self.plots.iter().zip(plots) {
            plot.write(out, [left, left + wide_plot], top)?;
        }
        page.close(out)
    }

    /// One entry for each name, in the order in which names appear.
    fn legend(&self) -> Vec<Entry> {
        let mut entries: Vec<Entry> = Vec::new();
        for stroke in self.panels.iter().flat_map(|panel| &panel.strokes) {
            if let Some(name) = stroke.name.as_ref().filter(|name| entries.iter().all(|entry| entry.text != **name)) {
                let (colour, width) = (hex(stroke.colour).into(), width(stroke));
                entries.push(Entry { colour, width, dashed: false, dot: None, text: name.clone() });
            }
        }
        entries
    }
}

/// The width of one of `columns` columns.
fn column(width: f64, columns: usize) -> f64 {
    ((width - 2.0 * SIDE - GAP * (columns - 1) as f64) / columns as f64).max(20.0)
}

/// Places a row of panels from `top` on. Returns where the row ends.
fn place(row: &[Panel], wide: f64, top: f64, placed: &mut Vec<Placed>) -> f64 {
    // Titles are 13 pixels high, but `wrap` counts with 12.
    let titles: Vec<_> = row.iter().map(|panel| wrap(&panel.title, wide * 12.0 / 13.0)).collect();
    let lines = titles.iter().map(Vec::len).max().unwrap_or(0);
    let bounds: Vec<Bounds> = row.iter().map(Panel::bounds).collect();
    let sizes = bounds.iter().map(|b| b.high - b.low).filter(|size| size.is_finite());
    let extent = sizes.fold(DVec2::ZERO, DVec2::max);
    let side = if extent.max_element() > 0.0 { extent.max_element() } else { 1.0 };
    let extent = extent.max(DVec2::splat(side * 1e-9));
    let inner = wide - 2.0 * MARGIN;
    let high = (inner * extent.y / extent.x).clamp(LOWEST * inner, HIGHEST * inner) + 2.0 * MARGIN;
    let head = top + LINE * lines as f64;
    for (k, (bounds, title)) in bounds.into_iter().zip(titles).enumerate() {
        let left = SIDE + k as f64 * (wide + GAP);
        let frame = Frame::inside(bounds, extent, [left, head, left + wide, head + high], MARGIN);
        placed.push(Placed { title, corner: [left, top + 13.0], frame });
    }
    head + high + row.iter().map(Panel::foot).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{PI, TAU};

    use roxmltree::{Document, Node};

    use super::*;
    use crate::picture::{Axis, Series};

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
        Panel::evolution(format!("a wave {length} long"), &[DVec2::ZERO, DVec2::X * length], &curves)
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
            panels: vec![waves(2.0), waves(4.0), Panel::fan("cubics by end angle", &fan)],
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
        let svg = sheet.draw();
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
    fn panels_of_a_row_have_one_scale_and_nothing_overlaps() {
        let sheet = demonstration();
        let (mut placed, wide) = (Vec::new(), column(sheet.width, 2));
        let end = place(&sheet.panels[..2], wide, 44.0, &mut placed);
        assert_eq!(placed[0].frame.scale, placed[1].frame.scale);
        let [a, b] = [placed[0].frame.plot, placed[1].frame.plot];
        assert!(a[2] < b[0] && b[2] <= sheet.width && a[3] == b[3] && a[3] <= end, "{a:?} {b:?}");
        // The longer wave fills its panel from margin to margin, the shorter one stands in the
        // middle.
        let across =
            |at: &Placed, length: f64| [0.0, length].map(|x| at.frame.map(DVec2::new(x, 0.0)).x - at.frame.plot[0]);
        assert_eq!(across(&placed[1], 4.0), [MARGIN, wide - MARGIN]);
        let [left, right] = across(&placed[0], 2.0);
        assert!((left + right - wide).abs() < 1e-9 && (right - left - 0.5 * (wide - 2.0 * MARGIN)).abs() < 1e-9);
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
                Panel::evolution("dots alone", &[DVec2::ONE], &[]),
                Panel::evolution("bad", &bad[..3], &[bad.to_vec(), vec![DVec2::ZERO, bad[0], DVec2::ONE]]),
                Panel::fan("bad", &[(f64::NAN, bad.to_vec()), (1.0, Vec::new())]),
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
}
