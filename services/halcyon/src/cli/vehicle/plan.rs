//! QGroundControl's `.plan` (<https://docs.qgroundcontrol.com/master/en/qgc-dev-guide/file_formats/plan.html>): mission, fence and rally points
//! in one JSON file. Surveys and other complex items are read where the file has their waypoints; writing knows simple items.

use halcyon_model::{Item, ItemFrame, ItemKind};
use serde_json::{Value, json};

use super::waypoints::Home;

const CIRCLE: [u16; 2] = [5004, 5003];
const VERTEX: [u16; 2] = [5002, 5001];

/// The items of one kind in a file.
///
/// # Errors
/// One line that says what is wrong.
pub(super) fn read(text: &str, kind: ItemKind) -> Result<Vec<Item>, String> {
    let plan: Value = serde_json::from_str(text).map_err(|error| format!("not JSON: {error}"))?;
    if plan["fileType"] != "Plan" {
        return Err("not a plan of QGroundControl (fileType is not Plan)".into());
    }
    match kind {
        ItemKind::Mission => mission(&plan["mission"]["items"]),
        ItemKind::Fence => fence(&plan["geoFence"]),
        ItemKind::Rally => list(&plan["rallyPoints"]["points"]).map(rally_point).collect(),
    }
}

fn list(value: &Value) -> impl Iterator<Item = &Value> {
    value.as_array().into_iter().flatten()
}

fn mission(items: &Value) -> Result<Vec<Item>, String> {
    let mut read = Vec::new();
    for (at, item) in list(items).enumerate() {
        let wrong = |what: &str| format!("item {}: {what}", at + 1);
        if item["type"] == "ComplexItem" {
            let inner = &item["TransectStyleComplexItem"]["Items"];
            if !inner.is_array() {
                return Err(wrong("a complex item whose waypoints the file does not have"));
            }
            for item in list(inner) {
                read.push(simple(item).map_err(|what| wrong(&what))?);
            }
        } else {
            read.push(simple(item).map_err(|what| wrong(&what))?);
        }
    }
    Ok(read)
}

fn simple(item: &Value) -> Result<Item, String> {
    let command = item["command"].as_u64().and_then(|command| u16::try_from(command).ok()).ok_or("no command")?;
    let frame = item["frame"].as_u64().and_then(|frame| u8::try_from(frame).ok()).and_then(ItemFrame::from_number);
    let params: Vec<Option<f64>> = list(&item["params"]).map(Value::as_f64).collect();
    let [p1, p2, p3, p4, latitude_deg, longitude_deg, altitude_m] = params[..] else {
        return Err(format!("{} params, not 7", params.len()));
    };
    Ok(Item {
        command,
        frame: frame.ok_or("its frame is not supported")?,
        parameters: [p1, p2, p3, p4],
        latitude_deg,
        longitude_deg,
        altitude_m,
        autocontinue: item["autoContinue"].as_bool().unwrap_or(true),
    })
}

fn place(value: &Value) -> Result<(f64, f64), String> {
    match (value[0].as_f64(), value[1].as_f64()) {
        (Some(latitude_deg), Some(longitude_deg)) => Ok((latitude_deg, longitude_deg)),
        _ => Err("a place is not a latitude and a longitude".into()),
    }
}

fn at(command: u16, (latitude_deg, longitude_deg): (f64, f64), parameter1: f64) -> Item {
    Item {
        command,
        frame: ItemFrame::SeaLevel,
        parameters: [Some(parameter1), Some(0.0), Some(0.0), Some(0.0)],
        latitude_deg: Some(latitude_deg),
        longitude_deg: Some(longitude_deg),
        altitude_m: Some(0.0),
        autocontinue: true,
    }
}

/// A polygon is a vertex an item, each with the number of vertices; a circle one item with its radius.
fn fence(value: &Value) -> Result<Vec<Item>, String> {
    let mut read = Vec::new();
    let inside = |shape: &Value| usize::from(shape["inclusion"].as_bool().unwrap_or(true));
    for shape in list(&value["polygons"]) {
        let vertices: Vec<_> = list(&shape["polygon"]).map(place).collect::<Result<_, _>>()?;
        let count = vertices.len() as f64;
        read.extend(vertices.into_iter().map(|vertex| at(VERTEX[inside(shape)], vertex, count)));
    }
    for shape in list(&value["circles"]) {
        let radius_m = shape["circle"]["radius"].as_f64().ok_or("a circle has no radius")?;
        read.push(at(CIRCLE[inside(shape)], place(&shape["circle"]["center"])?, radius_m));
    }
    Ok(read)
}

fn rally_point(value: &Value) -> Result<Item, String> {
    let place = place(value)?;
    Ok(Item { frame: ItemFrame::Home, altitude_m: value[2].as_f64(), ..at(5100, place, 0.0) })
}

/// A plan that holds one list.
///
/// # Errors
/// If it holds what the format cannot.
pub(super) fn write(items: &[Item], kind: ItemKind, home: Home) -> Result<String, String> {
    let mut plan = json!({
        "fileType": "Plan",
        "groundStation": "QGroundControl",
        "version": 1,
        "mission": {
            "version": 2, "firmwareType": 3, "vehicleType": 2, "cruiseSpeed": 5, "hoverSpeed": 5,
            "globalPlanAltitudeMode": 1, "plannedHomePosition": [home.0, home.1, home.2], "items": [],
        },
        "geoFence": { "version": 2, "circles": [], "polygons": [] },
        "rallyPoints": { "version": 2, "points": [] },
    });
    match kind {
        ItemKind::Mission => {
            let simple = |(item, number): (&Item, usize)| {
                let [p1, p2, p3, p4] = item.parameters;
                json!({
                    "type": "SimpleItem", "autoContinue": item.autocontinue, "command": item.command,
                    "doJumpId": number, "frame": item.frame.number(),
                    "params": [p1, p2, p3, p4, item.latitude_deg, item.longitude_deg, item.altitude_m],
                })
            };
            plan["mission"]["items"] = items.iter().zip(1..).map(simple).collect();
        }
        ItemKind::Rally => {
            let point = |item: &Item| json!([item.latitude_deg, item.longitude_deg, item.altitude_m]);
            plan["rallyPoints"]["points"] = items.iter().map(point).collect();
        }
        ItemKind::Fence => plan["geoFence"] = shapes(items)?,
    }
    let mut text = serde_json::to_string_pretty(&plan).map_err(|error| error.to_string())?;
    text.push('\n');
    Ok(text)
}

fn shapes(mut items: &[Item]) -> Result<Value, String> {
    let (mut circles, mut polygons) = (Vec::new(), Vec::new());
    while let Some((first, rest)) = items.split_first() {
        let number = first.parameters[0].unwrap_or(0.0);
        let inside = |kinds: [u16; 2]| kinds.iter().position(|kind| *kind == first.command).map(|at| at == 1);
        if let Some(inclusion) = inside(CIRCLE) {
            let circle = json!({ "center": [first.latitude_deg, first.longitude_deg], "radius": number });
            circles.push(json!({ "circle": circle, "inclusion": inclusion, "version": 1 }));
            items = rest;
        } else if let Some(inclusion) = inside(VERTEX) {
            let (vertices, rest) = items.split_at_checked(number.max(1.0) as usize).ok_or("a polygon lacks vertices")?;
            let corners: Vec<_> = vertices.iter().map(|item| json!([item.latitude_deg, item.longitude_deg])).collect();
            polygons.push(json!({ "polygon": corners, "inclusion": inclusion, "version": 1 }));
            items = rest;
        } else {
            return Err(format!("command {} has no place in a plan's fence", first.command));
        }
    }
    Ok(json!({ "version": 2, "circles": circles, "polygons": polygons }))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// After the example of QGroundControl's developer guide.
    fn sample() -> String {
        json!({
            "fileType": "Plan", "groundStation": "QGroundControl", "version": 1,
            "mission": { "items": [
                { "type": "SimpleItem", "autoContinue": true, "command": 22, "doJumpId": 1, "frame": 3,
                  "params": [15, 0, 0, null, 47.3985099, 8.5451002, 50] },
                { "type": "ComplexItem", "complexItemType": "survey", "TransectStyleComplexItem": { "Items": [
                    { "type": "SimpleItem", "autoContinue": true, "command": 16, "doJumpId": 2, "frame": 3,
                      "params": [0, 0, 0, null, 47.4, 8.55, 50] } ] } },
            ] },
            "geoFence": { "version": 2,
                "circles": [{ "circle": { "center": [47.39, 8.54], "radius": 319.85 }, "inclusion": true, "version": 1 }],
                "polygons": [{ "inclusion": false, "version": 1, "polygon": [[47.1, 8.1], [47.2, 8.2], [47.3, 8.1]] }] },
            "rallyPoints": { "version": 2, "points": [[47.39760401, 8.5509154, 50]] },
        })
        .to_string()
    }

    #[test]
    fn all_three_lists_are_read_and_written() {
        let mission = read(&sample(), ItemKind::Mission).unwrap();
        assert_eq!(mission.iter().map(|item| item.command).collect::<Vec<_>>(), [22, 16]);
        assert_eq!(
            (mission[0].parameters[3], mission[0].latitude_deg, mission[0].altitude_m),
            (None, Some(47.398_509_9), Some(50.0))
        );
        // MAV_CMD_NAV_FENCE_POLYGON_VERTEX_EXCLUSION with the vertex count, MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION with the radius.
        let fence = read(&sample(), ItemKind::Fence).unwrap();
        let seen: Vec<_> = fence.iter().map(|item| (item.command, item.parameters[0].unwrap())).collect();
        assert_eq!(seen, [(5002, 3.0), (5002, 3.0), (5002, 3.0), (5003, 319.85)]);
        let rally = read(&sample(), ItemKind::Rally).unwrap();
        assert_eq!((rally[0].command, rally[0].frame, rally[0].altitude_m), (5100, ItemFrame::Home, Some(50.0)));
        for (kind, items) in [(ItemKind::Mission, mission), (ItemKind::Fence, fence), (ItemKind::Rally, rally)] {
            for item in &items {
                assert_eq!(item.problem(kind), None);
            }
            let text = write(&items, kind, (47.0, 8.0, 400.0)).unwrap();
            assert_eq!(read(&text, kind), Ok(items));
        }
    }

    #[test]
    fn what_is_wrong_is_said() {
        let mission = |items: Value| {
            read(&json!({ "fileType": "Plan", "mission": { "items": items } }).to_string(), ItemKind::Mission).unwrap_err()
        };
        assert!(read("{", ItemKind::Mission).unwrap_err().contains("JSON"));
        assert!(read("{}", ItemKind::Mission).unwrap_err().contains("fileType"));
        assert!(mission(json!([{ "type": "ComplexItem" }])).contains("item 1"));
        assert!(mission(json!([{ "command": 16, "frame": 1, "params": [0, 0, 0, 0, 0, 0, 0] }])).contains("frame"));
        assert!(mission(json!([{ "command": 16, "frame": 3, "params": [0] }])).contains("1 params"));
        assert!(write(&[at(5001, (1.0, 2.0), 3.0)], ItemKind::Fence, (0.0, 0.0, 0.0)).is_err());
    }
}
