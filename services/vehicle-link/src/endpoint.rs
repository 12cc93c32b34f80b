//! Where a link or a station is, as people write it: `udpin:0.0.0.0:14550`.

use std::str::FromStr;

/// One end of a MAVLink connection.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Endpoint {
    /// Calls a TCP server.
    TcpOut(String),
    /// Waits for a TCP caller.
    TcpIn(String),
    /// Sends datagrams to a place, and takes those that come back.
    UdpOut(String),
    /// Waits for datagrams and answers whoever sent them.
    UdpIn(String),
    /// A serial port.
    Serial {
        /// Such as `/dev/ttyACM0`.
        device: String,
        /// Bits per second.
        baud_bps: u32,
    },
}

impl FromStr for Endpoint {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let problem =
            || format!("endpoint must be tcpout:, tcpin:, udpin: or udpout:host:port, or serial:device:baud, not {text:?}");
        let (scheme, place) = text.split_once(':').ok_or_else(problem)?;
        let (host, number) = place.rsplit_once(':').ok_or_else(problem)?;
        if host.is_empty() {
            return Err(problem());
        }
        let port = number.parse::<u16>().ok();
        let endpoint = match (scheme, port) {
            ("tcpout", Some(1..)) => Self::TcpOut(place.to_owned()),
            ("udpout", Some(1..)) => Self::UdpOut(place.to_owned()),
            ("tcpin", Some(_)) => Self::TcpIn(place.to_owned()),
            ("udpin", Some(_)) => Self::UdpIn(place.to_owned()),
            ("serial", _) => {
                let baud_bps = number.parse().ok().filter(|baud| *baud > 0).ok_or_else(problem)?;
                Self::Serial { device: host.to_owned(), baud_bps }
            }
            _ => return Err(problem()),
        };
        Ok(endpoint)
    }
}
