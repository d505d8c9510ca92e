//! The figure of a chart for a page that people explore: they zoom, point at lines, and hide lines by their legend.
//!
//! Plotly draws it in the browser. The figure is plain JSON in Plotly's format, and the page holds Plotly itself, so that it
//! opens without a network. Must never show anything that the SVG of the chart does not.

use crate::{
    chart::{Band, Chart, Curve, Mark, Stroke, Symbol},
    colour::hex,
    scale::Scale,
};
use base64::{Engine, prelude::BASE64_STANDARD};
use serde_json::{Map, Value, json};
use std::collections::BTreeSet;

/// Bands whose names are written into the plot. More names would cover each other and the lines.
const NAMED_BANDS: usize = 8;
/// Opacity of bands. A higher one hides lines; at a lower one bands vanish on a dark page.
const SHADE: f64 = 0.13;

/// The HTML element that defines `Plotly`.
#[must_use]
pub fn plotly_script() -> String {
    let sources = plotly::Plot::offline_js_sources();
    // The crate adds MathJax in a second element. Our labels contain no formulas, and it would add 2 MB to every page.
    let end = "</script>";
    let length = sources.find(end).map_or(sources.len(), |at| at + end.len());
    sources.get(..length).unwrap_or_default().to_owned()
}

impl Chart {
    /// The chart as a Plotly figure: an object with `data` and `layout`.
    #[must_use]
    pub fn figure(&self) -> Value {
        let mut listed = BTreeSet::new();
        let mut data: Vec<Value> = Vec::new();
        for line in &self.lines {
            // The legend has one row for each name. Hiding it hides all lines of that name.
            let is_listed = !line.name.is_empty() && listed.insert(line.name.as_str());
            data.push(self.trace(line, is_listed));
        }
        data.extend(arrows(&self.marks));
        data.extend(crosses(&self.marks));
        let labels: Vec<Value> = self.marks.iter().filter(|mark| !mark.text.is_empty()).map(label).collect();
        json!({
            "data": data,
            "layout": {
                "xaxis": self.x_axis(),
                "yaxis": self.y_axis(),
                "shapes": self.bands.iter().map(|band| shape(band, self.bands.len())).collect::<Vec<_>>(),
                "annotations": labels,
                "hovermode": if self.is_map { "closest" } else { "x" },
            },
        })
    }

    fn trace(&self, line: &Curve, is_listed: bool) -> Value {
        let points = self.drawn_points(line);
        let value = |scale: Scale, value: f64| match scale {
            // Plotly takes the values themselves on a logarithmic axis.
            Scale::Powers | Scale::Log => 10_f64.powf(value),
            Scale::Linear | Scale::Shares => value,
        };
        // Plotly breaks a line where a coordinate is not a number.
        let coordinate = |scale, get: fn((f64, f64)) -> f64| -> Vec<f32> {
            points
                .iter()
                .map(|point| point.map_or(f32::NAN, |point| value(scale, get(point)) as f32))
                .collect()
        };
        let mut trace = json!({
            "type": "scatter",
            "mode": if line.stroke == Stroke::Dotted { "lines+markers" } else { "lines" },
            "name": line.name,
            "legendgroup": line.name,
            "showlegend": is_listed,
            "x": typed(&coordinate(self.x_scale, |(x, _)| x)),
            "y": typed(&coordinate(self.y_scale, |(_, y)| y)),
            "line": {
                "color": hex(line.colour),
                "width": 1.6,
                "dash": if line.stroke == Stroke::Dashed { "dash" } else { "solid" },
            },
        });
        if line.stroke == Stroke::Filled {
            trace["fill"] = "toself".into();
        }
        if line.name.is_empty() {
            trace["hoverinfo"] = "skip".into();
        }
        trace
    }

    fn x_axis(&self) -> Value {
        let mut axis = axis(self.x, self.x_scale);
        if self.is_map {
            // A unit has the same length on both axes, however the page is sized.
            axis.insert("scaleanchor".into(), "y".into());
        }
        axis.into()
    }

    fn y_axis(&self) -> Value {
        let mut axis = axis(self.y, self.y_scale);
        if self.from_zero {
            axis.insert("rangemode".into(), "tozero".into());
        }
        if self.is_rows {
            axis.insert("showticklabels".into(), false.into());
            axis.insert("showgrid".into(), false.into());
        }
        axis.into()
    }
}

fn axis(title: &str, scale: Scale) -> Map<String, Value> {
    let mut axis = Map::new();
    axis.insert("title".into(), json!({ "text": title }));
    match scale {
        Scale::Linear => {}
        Scale::Powers | Scale::Log => {
            axis.insert("type".into(), "log".into());
            axis.insert("exponentformat".into(), "power".into());
        }
        Scale::Shares => {
            let nines: Vec<u32> = (0..=6).collect();
            let labels: Vec<String> = nines.iter().map(|nines| scale.label(f64::from(*nines))).collect();
            axis.insert("tickvals".into(), json!(nines));
            axis.insert("ticktext".into(), json!(labels));
        }
    }
    axis
}

/// Numbers as Plotly reads them fastest: their bytes in base 64, which also takes a third of the room of decimals.
fn typed(values: &[f32]) -> Value {
    let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
    json!({ "dtype": "f4", "bdata": BASE64_STANDARD.encode(bytes) })
}

/// The shade of `band`, which is one of `count`.
fn shape(band: &Band, count: usize) -> Value {
    let mut shape = json!({
        "type": "rect",
        "xref": "x",
        "yref": "paper",
        "x0": band.from,
        "x1": band.to,
        "y0": 0,
        "y1": 1,
        "fillcolor": hex(band.colour),
        "opacity": SHADE,
        "line": { "width": 0 },
        "layer": "below",
    });
    if count <= NAMED_BANDS {
        let (text, font) = (&band.name, json!({ "size": 10 }));
        shape["label"] = json!({ "text": text, "textposition": "top left", "font": font });
    }
    shape
}

/// All arrows as one trace that is not in the legend.
fn arrows(marks: &[Mark]) -> Option<Value> {
    let arrows: Vec<(&Mark, f64)> = marks
        .iter()
        .filter_map(
            |mark| if let Symbol::Arrow(heading) = mark.symbol { Some((mark, heading)) } else { None },
        )
        .collect();
    let colours: Vec<String> = arrows.iter().map(|(mark, _)| hex(mark.colour)).collect();
    // Plotly's arrow points up and turns clockwise; a heading of 0 points right and grows counterclockwise.
    let angles: Vec<f64> = arrows.iter().map(|(_, heading)| 90.0 - heading.to_degrees()).collect();
    let marker = json!({ "symbol": "arrow", "size": 11, "angle": angles, "color": colours });
    markers(&arrows.iter().map(|(mark, _)| *mark).collect::<Vec<_>>(), "heading", &marker)
}

/// All crosses as one trace.
fn crosses(marks: &[Mark]) -> Option<Value> {
    let crosses: Vec<&Mark> = marks.iter().filter(|mark| mark.symbol == Symbol::Cross).collect();
    let colours: Vec<String> = crosses.iter().map(|mark| hex(mark.colour)).collect();
    let marker = json!({ "symbol": "x", "size": 11, "color": colours });
    markers(&crosses, "collision", &marker)
}

fn markers(marks: &[&Mark], name: &str, marker: &Value) -> Option<Value> {
    let coordinate =
        |get: fn((f64, f64)) -> f64| -> Vec<f64> { marks.iter().map(|mark| get(mark.at)).collect() };
    (!marks.is_empty()).then(|| {
        json!({
            "type": "scatter",
            "mode": "markers",
            "name": name,
            "showlegend": true,
            "x": coordinate(|(x, _)| x),
            "y": coordinate(|(_, y)| y),
            "text": marks.iter().map(|mark| mark.text.as_str()).collect::<Vec<_>>(),
            "marker": marker,
        })
    })
}

fn label(mark: &Mark) -> Value {
    json!({
        "x": mark.at.0,
        "y": mark.at.1,
        "text": mark.text,
        "showarrow": false,
        "xanchor": "left",
        "yanchor": "bottom",
        "xshift": 5,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use plotters::style::RGBColor;

    fn line(name: &str, points: Vec<Option<(f64, f64)>>) -> Curve {
        Curve { name: name.into(), colour: RGBColor(0, 0x72, 0xb2), stroke: Stroke::Solid, points }
    }

    fn numbers(typed: &Value) -> Vec<f32> {
        let bytes = BASE64_STANDARD.decode(typed["bdata"].as_str().unwrap()).unwrap();
        bytes.chunks(4).map(|four| f32::from_le_bytes(four.try_into().unwrap())).collect()
    }

    #[test]
    fn a_figure_has_the_points_of_the_chart_and_its_breaks() {
        let lines =
            vec![line("uav 1", vec![Some((0.0, 2.0)), None, Some((1.0, -1.0))]), line("uav 1", vec![])];
        let figure = Chart { lines, y_scale: Scale::Powers, ..Chart::default() }.figure();
        let y = numbers(&figure["data"][0]["y"]);
        assert_eq!((y[0], y[2]), (100.0, 0.1), "logarithms become values");
        assert!(y[1].is_nan());
        assert_eq!(figure["layout"]["yaxis"]["type"], "log");
        let listed: Vec<_> =
            [0, 1].map(|index| figure["data"][index]["showlegend"].as_bool().unwrap()).into();
        assert_eq!(listed, [true, false], "the legend lists a name once");
    }

    #[test]
    fn bands_are_named_until_they_are_too_many() {
        let band = |at: u32| Band {
            name: format!("fault {at}"),
            colour: RGBColor(0, 0, 0),
            from: f64::from(at),
            to: f64::from(at) + 0.5,
        };
        let of = |count: u32| Chart { bands: (0..count).map(band).collect(), ..Chart::default() }.figure();
        assert_eq!(of(8)["layout"]["shapes"][7]["label"]["text"], "fault 7");
        let crowded = of(9);
        assert_eq!(crowded["layout"]["shapes"].as_array().unwrap().len(), 9);
        assert!(crowded["layout"]["shapes"][0]["label"].is_null());
    }

    #[test]
    fn arrows_point_along_their_heading() {
        let mark = |symbol| Mark { at: (1.0, 2.0), text: "10 s".into(), symbol, colour: RGBColor(0, 0, 0) };
        let quarter = std::f64::consts::FRAC_PI_2;
        let marks = vec![mark(Symbol::Arrow(0.0)), mark(Symbol::Arrow(quarter)), mark(Symbol::Cross)];
        let figure = Chart { marks, ..Chart::default() }.figure();
        assert_eq!(figure["data"][0]["marker"]["angle"], json!([90.0, 0.0]));
        assert_eq!(figure["data"][1]["marker"]["symbol"], "x");
        assert_eq!(figure["layout"]["annotations"].as_array().unwrap().len(), 3);
    }

    #[test]
    fn the_script_is_plotly_alone() {
        let script = plotly_script();
        assert!(script.contains("plotly.js v") && script.ends_with("</script>"));
        assert_eq!(script.matches("</script>").count(), 1);
        assert!(script.len() < 5_000_000, "{} bytes", script.len());
    }
}
