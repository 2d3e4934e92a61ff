//! Plots of measurements over component counts, as self-contained SVG images.

use std::fmt::{self, Display, Write};

use jaus_view::junit::escaped;

/// One line of a plot.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// Name in the legend.
    pub name: String,
    /// Points: component count, and measurement above 0.
    pub points: Vec<(f64, f64)>,
}

/// A plot with two logarithmic axes.
#[derive(Debug, Clone, PartialEq)]
pub struct Plot {
    /// Title above the plot.
    pub title: String,
    /// Label of the horizontal axis.
    pub across: String,
    /// Label of the vertical axis.
    pub up: String,
    /// The lines to plot.
    pub lines: Vec<Line>,
}

const WIDTH: f64 = 720.0;
const HEIGHT: f64 = 440.0;
const LEFT: f64 = 80.0;
const RIGHT: f64 = 160.0;
const TOP: f64 = 50.0;
const BOTTOM: f64 = 60.0;
/// Colours for colour-blind readers, and dashes for prints without colour.
const STYLES: [(&str, &str); 5] = [
    ("#0072b2", ""),
    ("#009e73", "8 4"),
    ("#d55e00", "2 3"),
    ("#cc79a7", "10 3 2 3"),
    ("#555555", "4 4"),
];

/// A logarithmic axis between two bounds.
struct Axis {
    least: f64,
    most: f64,
    /// Positions of the bounds in the image.
    from: f64,
    to: f64,
}

impl Axis {
    /// An axis that covers all values.
    fn over(values: impl Iterator<Item = f64> + Clone, from: f64, to: f64) -> Self {
        let good = values.filter(|value| value.is_finite() && *value > 0.0);
        let least = good.clone().fold(f64::INFINITY, f64::min);
        let most = good.fold(0.0, f64::max);
        let (least, most) = if least > most {
            (1.0, 10.0)
        } else {
            (least, most)
        };
        Self {
            least,
            most: most.max(least * 1.5),
            from,
            to,
        }
    }

    fn place(&self, value: f64) -> f64 {
        let value = value.max(self.least * 1e-3);
        let share = (value / self.least).ln() / (self.most / self.least).ln();
        self.from + share * (self.to - self.from)
    }

    /// The powers of ten within the bounds. For a short axis also 2 and 5 times those.
    fn marks(&self) -> Vec<f64> {
        let first = self.least.log10().floor() as i32;
        let last = self.most.log10().ceil() as i32;
        let factors: &[f64] = if self.most > 300.0 * self.least {
            &[1.0]
        } else {
            &[1.0, 2.0, 5.0]
        };
        let all =
            (first..=last).flat_map(|power| factors.iter().map(move |it| it * 10_f64.powi(power)));
        let within = self.least * 0.999..=self.most * 1.001;
        all.filter(|mark| within.contains(mark)).collect()
    }
}

impl Display for Plot {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let points = self.lines.iter().flat_map(|line| &line.points);
        let across = points.clone().map(|point| point.0);
        let across = Axis::over(across, LEFT, WIDTH - RIGHT);
        let figures = points.map(|point| point.1);
        let widened = figures.flat_map(|figure| [figure / 1.2, figure * 1.2]);
        let up = Axis::over(widened, HEIGHT - BOTTOM, TOP);
        writeln!(
            f,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" \
             font-family=\"sans-serif\" font-size=\"13\">\n\
             <rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n\
             <text x=\"{LEFT}\" y=\"28\" font-size=\"16\">{}</text>",
            escaped(&self.title)
        )?;
        self.grid(f, &across, &up)?;
        for (index, line) in self.lines.iter().enumerate() {
            let (colour, dashes) = STYLES[index % STYLES.len()];
            line.draw(f, &across, &up, colour, dashes)?;
            let y = TOP + 20.0 * index as f64;
            let x = WIDTH - RIGHT + 14.0;
            writeln!(
                f,
                "<path d=\"M{x} {y}h24\" stroke=\"{colour}\" stroke-width=\"2.5\" \
                 stroke-dasharray=\"{dashes}\"/><text x=\"{}\" y=\"{}\">{}</text>",
                x + 30.0,
                y + 4.0,
                escaped(&line.name)
            )?;
        }
        writeln!(f, "</svg>")
    }
}

impl Plot {
    /// Draws the grid and the axis labels.
    fn grid(&self, f: &mut fmt::Formatter<'_>, across: &Axis, up: &Axis) -> fmt::Result {
        let (bottom, right) = (HEIGHT - BOTTOM, WIDTH - RIGHT);
        let mut grid = String::new();
        let mut words = String::new();
        for mark in across.marks() {
            let x = across.place(mark);
            write!(grid, "M{x:.1} {TOP}V{bottom}")?;
            let y = bottom + 18.0;
            write!(
                words,
                "<text x=\"{x:.1}\" y=\"{y}\" text-anchor=\"middle\">{mark}</text>"
            )?;
        }
        for mark in up.marks() {
            let y = up.place(mark);
            write!(grid, "M{LEFT} {y:.1}H{right}")?;
            let (x, y) = (LEFT - 8.0, y + 4.0);
            write!(
                words,
                "<text x=\"{x}\" y=\"{y:.1}\" text-anchor=\"end\">{mark}</text>"
            )?;
        }
        let middle = f64::midpoint(TOP, bottom);
        writeln!(
            f,
            "<path d=\"{grid}\" stroke=\"#ddd\" fill=\"none\"/>\n\
             <path d=\"M{LEFT} {TOP}V{bottom}H{right}\" stroke=\"#333\" fill=\"none\"/>\n{words}\n\
             <text x=\"{:.1}\" y=\"{}\" text-anchor=\"middle\">{}</text>\n\
             <text transform=\"translate(22 {middle:.1}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
            f64::midpoint(LEFT, right),
            HEIGHT - 16.0,
            escaped(&self.across),
            escaped(&self.up)
        )
    }
}

impl Line {
    fn draw(
        &self,
        f: &mut fmt::Formatter<'_>,
        across: &Axis,
        up: &Axis,
        colour: &str,
        dashes: &str,
    ) -> fmt::Result {
        let good = self.points.iter().filter(|(_, figure)| *figure > 0.0);
        let places: Vec<_> = good.map(|&(x, y)| (across.place(x), up.place(y))).collect();
        let line: Vec<_> = places
            .iter()
            .map(|(x, y)| format!("{x:.1},{y:.1}"))
            .collect();
        writeln!(
            f,
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2.5\" \
             stroke-dasharray=\"{dashes}\"/>",
            line.join(" ")
        )?;
        for (x, y) in places {
            writeln!(
                f,
                "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3.5\" fill=\"{colour}\"/>"
            )?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plot(points: Vec<(f64, f64)>) -> String {
        let plot = Plot {
            title: "a < b & c".to_owned(),
            across: "components".to_owned(),
            up: "microseconds".to_owned(),
            lines: vec![Line {
                name: "mean".to_owned(),
                points,
            }],
        };
        plot.to_string()
    }

    #[test]
    fn each_point_has_its_place_within_the_picture() {
        let svg = plot(vec![(2.0, 20.0), (20.0, 200.0), (200.0, 2000.0)]);
        assert_eq!(svg.matches("<circle").count(), 3);
        assert!(svg.contains("a &lt; b &amp; c"), "{svg}");
        assert!(
            svg.contains(">100<") && svg.contains(">1000<"),
            "marks: {svg}"
        );
        for circle in svg.split("<circle cx=\"").skip(1) {
            let x: f64 = circle.split('"').next().unwrap().parse().unwrap();
            assert!((LEFT..=WIDTH - RIGHT).contains(&x), "{x}");
        }
    }

    #[test]
    fn without_figures_and_with_bad_ones_it_is_still_a_picture() {
        for points in [vec![], vec![(0.0, f64::NAN), (5.0, 0.0)], vec![(3.0, 3.0)]] {
            let svg = plot(points);
            assert!(svg.ends_with("</svg>\n") && !svg.contains("NaN"), "{svg}");
        }
    }
}
