use halcyon_model::transfer::{ITEMS_MAX, PARAMETERS_MAX};
use halcyon_model::{Content, Item, ItemFrame, ItemKind, Parameter, ParameterKind, ParameterName};

use crate::field::{FieldError, Within, finite, known, unspecified};
use crate::v1;

pub(super) fn name_from(path: &str, text: String) -> Result<ParameterName, FieldError> {
    ParameterName::new(text).map_err(|error| FieldError::new(path, error.to_string()))
}

fn parameter_to(parameter: &Parameter) -> v1::Parameter {
    v1::Parameter { name: parameter.name.to_string(), value: parameter.value, kind: i32::from(parameter.kind.number()) }
}

fn parameter_from(parameter: v1::Parameter) -> Result<Parameter, FieldError> {
    let number = known::<v1::ParameterKind>("kind", parameter.kind)?;
    Ok(Parameter {
        name: name_from("name", parameter.name)?,
        value: finite("value", parameter.value)?,
        kind: ParameterKind::from_number(number as u8).ok_or_else(|| unspecified("kind"))?,
    })
}

pub(super) fn kind_to(kind: ItemKind) -> i32 {
    let kind = match kind {
        ItemKind::Mission => v1::ItemKind::Mission,
        ItemKind::Fence => v1::ItemKind::Fence,
        ItemKind::Rally => v1::ItemKind::Rally,
    };
    kind.into()
}

pub(super) fn kind_from(path: &str, number: i32) -> Result<ItemKind, FieldError> {
    match known::<v1::ItemKind>(path, number)? {
        v1::ItemKind::Unspecified => Err(unspecified(path)),
        v1::ItemKind::Mission => Ok(ItemKind::Mission),
        v1::ItemKind::Fence => Ok(ItemKind::Fence),
        v1::ItemKind::Rally => Ok(ItemKind::Rally),
    }
}

fn frame_to(frame: ItemFrame) -> i32 {
    let frame = match frame {
        ItemFrame::SeaLevel => v1::ItemFrame::SeaLevel,
        ItemFrame::Home => v1::ItemFrame::Home,
        ItemFrame::Terrain => v1::ItemFrame::Terrain,
        ItemFrame::None => v1::ItemFrame::None,
    };
    frame.into()
}

fn frame_from(number: i32) -> Result<ItemFrame, FieldError> {
    match known::<v1::ItemFrame>("frame", number)? {
        v1::ItemFrame::Unspecified => Err(unspecified("frame")),
        v1::ItemFrame::SeaLevel => Ok(ItemFrame::SeaLevel),
        v1::ItemFrame::Home => Ok(ItemFrame::Home),
        v1::ItemFrame::Terrain => Ok(ItemFrame::Terrain),
        v1::ItemFrame::None => Ok(ItemFrame::None),
    }
}

fn item_to(item: &Item) -> v1::Item {
    let [parameter1, parameter2, parameter3, parameter4] = item.parameters;
    v1::Item {
        command: item.command.into(),
        frame: frame_to(item.frame),
        parameter1,
        parameter2,
        parameter3,
        parameter4,
        latitude_deg: item.latitude_deg,
        longitude_deg: item.longitude_deg,
        altitude_m: item.altitude_m,
        autocontinue: item.autocontinue,
    }
}

fn item_from(item: v1::Item) -> Result<Item, FieldError> {
    let number = |path: &str, value: Option<f64>| value.map(|value| finite(path, value)).transpose();
    let command = u16::try_from(item.command).map_err(|_| FieldError::new("command", "is not a MAV_CMD"))?;
    Ok(Item {
        command,
        frame: frame_from(item.frame)?,
        parameters: [
            number("parameter1", item.parameter1)?,
            number("parameter2", item.parameter2)?,
            number("parameter3", item.parameter3)?,
            number("parameter4", item.parameter4)?,
        ],
        latitude_deg: number("latitude_deg", item.latitude_deg)?,
        longitude_deg: number("longitude_deg", item.longitude_deg)?,
        altitude_m: number("altitude_m", item.altitude_m)?,
        autocontinue: item.autocontinue,
    })
}

fn bounded<P, T>(
    path: &str,
    values: Vec<P>,
    most: usize,
    convert: impl Fn(P) -> Result<T, FieldError>,
) -> Result<Vec<T>, FieldError> {
    if values.len() > most {
        return Err(FieldError::new(path, format!("holds {} of at most {most}", values.len())));
    }
    values.into_iter().enumerate().map(|(at, value)| convert(value).within(&format!("{path}[{at}]"))).collect()
}

pub(super) fn items_to(items: &[Item]) -> Vec<v1::Item> {
    items.iter().map(item_to).collect()
}

pub(super) fn items_from(path: &str, items: Vec<v1::Item>) -> Result<Vec<Item>, FieldError> {
    bounded(path, items, ITEMS_MAX, item_from)
}

pub(super) fn content_to(content: &Content) -> v1::command_reply::Content {
    use v1::command_reply::Content as Wire;
    match content {
        Content::Parameters(parameters) => {
            Wire::Parameters(v1::Parameters { parameters: parameters.iter().map(parameter_to).collect() })
        }
        Content::Items(items) => Wire::Items(v1::Items { items: items_to(items) }),
    }
}

pub(super) fn content_from(content: v1::command_reply::Content) -> Result<Content, FieldError> {
    use v1::command_reply::Content as Wire;
    match content {
        Wire::Parameters(list) => {
            bounded("parameters", list.parameters, PARAMETERS_MAX, parameter_from).map(Content::Parameters)
        }
        Wire::Items(list) => items_from("items", list.items).map(Content::Items),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test")]

    use halcyon_model::{CommandReply, Stamp, VehicleAction, VehicleCommand, VehicleId};

    use super::*;
    use crate::{Wire as _, decode, encode};

    fn item() -> Item {
        Item {
            command: 16,
            frame: ItemFrame::Terrain,
            parameters: [None, Some(2.0), Some(-0.5), None],
            latitude_deg: Some(53.1),
            longitude_deg: None,
            altitude_m: Some(5.5),
            autocontinue: true,
        }
    }

    fn command(action: VehicleAction) -> VehicleCommand {
        let stamp = Stamp::from_nanos(5);
        let vehicle = VehicleId::new("v").unwrap();
        VehicleCommand { stamp, deadline: stamp, who: "test".into(), vehicle, action }
    }

    #[test]
    fn there_and_back() {
        let name = || ParameterName::new("WPNAV_SPEED").unwrap();
        let mut actions = vec![
            VehicleAction::ReadParameter { name: name() },
            VehicleAction::ReadParameters,
            VehicleAction::SetParameter { name: name(), value: 450.0, even_in_flight: true },
            VehicleAction::CancelTransfer,
            VehicleAction::ReleasePayload,
            VehicleAction::SecurePayload,
        ];
        for kind in ItemKind::ALL {
            actions.push(VehicleAction::DownloadItems { kind });
            actions.push(VehicleAction::UploadItems { kind, items: vec![item(); 3] });
            actions.push(VehicleAction::ClearItems { kind });
        }
        for action in actions {
            let asked = command(action);
            assert_eq!(decode::<VehicleCommand>(encode(&asked).into()).unwrap(), asked);
        }
        let parameters = ParameterKind::ALL.map(|kind| Parameter { name: name(), value: -7.25, kind }).to_vec();
        for content in [Content::Parameters(parameters), Content::Items(vec![item()]), Content::Items(Vec::new())] {
            let reply = CommandReply { content: Some(content), ..CommandReply::accepted(Stamp::from_nanos(1), "read") };
            assert_eq!(decode::<CommandReply>(encode(&reply).into()).unwrap(), reply);
        }
    }

    #[test]
    fn what_makes_no_sense_is_refused_by_name() {
        let check = |action: v1::vehicle_command::Action, path: &str| {
            let mut proto = command(VehicleAction::Arm).to_proto();
            proto.action = Some(action);
            assert_eq!(VehicleCommand::from_proto(proto).unwrap_err().path(), path);
        };
        use v1::vehicle_command::Action;
        check(Action::ReadParameter("a b".into()), "action.read_parameter");
        let set = |value| v1::SetParameter { name: "X".into(), value, even_in_flight: false };
        check(Action::SetParameter(set(f64::NAN)), "action.set_parameter.value");
        check(Action::DownloadItems(0), "action.download_items");
        check(Action::ClearItems(9), "action.clear_items");
        let upload = |items| Action::UploadItems(v1::UploadItems { kind: 1, items });
        let bad = v1::Item { altitude_m: Some(f64::INFINITY), ..item_to(&item()) };
        check(upload(vec![item_to(&item()), bad]), "action.upload_items.items[1].altitude_m");
        check(upload(vec![v1::Item { command: 70_000, ..item_to(&item()) }]), "action.upload_items.items[0].command");
        check(upload(vec![item_to(&item()); ITEMS_MAX + 1]), "action.upload_items.items");
    }
}
