//! One vehicle: its clients, its clock, its truth on the bus.

use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr};
use std::sync::Arc;
use std::time::Duration;

use anyhow::Context as _;
use halcyon_chassis::{Context, Publisher, topics};
use halcyon_model::{LocalPoint, SimTruth, Stamp};
use halcyon_sim::SimConfig;
use halcyon_sim::autopilot::{LINKS_MAX, LinkId};
use halcyon_sim::vehicle::{STEP_NS, Vehicle};
use halcyon_sim::water::Water;
use tokio::net::{TcpListener, UdpSocket};
use tracing::{debug, warn};

use super::client::{Client, Gone};

/// How often it is stepped and its clients are heard, fleet time.
const TICK: Duration = Duration::from_millis(5);
/// Between two truths, fleet time: 50 Hz.
const TRUTH_EVERY_S: f64 = 0.02;
/// Most that is caught up in one go; then everybody else gets a turn.
const CATCH_UP_S: f64 = 1.0;
/// Further behind than this, a host was asleep: the time between never happened.
const BEHIND_MAX_S: f64 = 10.0;

pub(super) struct Server {
    context: Context,
    vehicle: Vehicle,
    listener: Arc<TcpListener>,
    water: Arc<Water>,
    truths: Publisher<SimTruth>,
    truth_due: Stamp,
    clients: Vec<Client>,
    next_link: u64,
}

impl Server {
    pub(super) async fn new(
        context: Context,
        config: &SimConfig,
        index: usize,
        listener: Arc<TcpListener>,
        water: Arc<Water>,
    ) -> anyhow::Result<Self> {
        let now = context.clock.now();
        let vehicle = Vehicle::new(config, index, context.origin, now).context("no such simulated vehicle")?;
        let truths = context.bus.publisher(&topics::sim_truth(vehicle.id())).await?;
        let mut server = Self { context, vehicle, listener, water, truths, truth_due: now, clients: Vec::new(), next_link: 0 };
        if let Some(address) = config.vehicles.get(index).and_then(|vehicle| vehicle.udp_out) {
            server.speak_to(address).await?;
        }
        Ok(server)
    }

    async fn speak_to(&mut self, address: SocketAddr) -> anyhow::Result<()> {
        let any = if address.is_ipv4() { IpAddr::V4(Ipv4Addr::UNSPECIFIED) } else { IpAddr::V6(Ipv6Addr::UNSPECIFIED) };
        let name = self.vehicle.id().clone();
        let socket = UdpSocket::bind(SocketAddr::new(any, 0)).await.with_context(|| format!("{name} has no UDP socket"))?;
        socket.connect(address).await.with_context(|| format!("{name} cannot speak to {address} over UDP"))?;
        let link = self.new_link();
        self.vehicle.attach(link);
        self.clients.push(Client::udp(link, socket));
        Ok(())
    }

    fn new_link(&mut self) -> LinkId {
        self.next_link += 1;
        LinkId(self.next_link)
    }

    pub(super) async fn run(mut self) -> anyhow::Result<()> {
        let mut ticker = self.context.clock.every(TICK);
        let listener = Arc::clone(&self.listener);
        let stop = self.context.stop.clone();
        loop {
            tokio::select! {
                () = stop.cancelled() => return Ok(()),
                accepted = listener.accept() => match accepted {
                    Ok((stream, address)) => {
                        let link = self.new_link();
                        if self.vehicle.attach(link) {
                            debug!(vehicle = %self.vehicle.id(), %address, "a MAVLink client connected");
                            self.clients.push(Client::tcp(link, stream));
                        } else {
                            warn!(vehicle = %self.vehicle.id(), %address, "a MAVLink client refused: {LINKS_MAX} are connected");
                        }
                    }
                    Err(error) => {
                        // Out of descriptors, mostly: others may close theirs meanwhile.
                        warn!(vehicle = %self.vehicle.id(), %error, "a MAVLink client could not connect");
                        self.context.clock.sleep(Duration::from_millis(200)).await;
                    }
                },
                _due = ticker.tick() => self.tick().await?,
            }
        }
    }

    async fn tick(&mut self) -> anyhow::Result<()> {
        let Self { vehicle, clients, .. } = self;
        clients.retain_mut(|client| {
            let link = client.link;
            let heard = client.heard(|frame| vehicle.receive(link, frame));
            keep(vehicle, link, heard)
        });
        self.advance().await?;
        self.speak();
        Ok(())
    }

    /// Simulates up to now, with a truth on the bus every 20 ms of it.
    async fn advance(&mut self) -> anyhow::Result<()> {
        let now = self.context.clock.now();
        let behind_s = now.seconds_since(self.vehicle.now());
        if behind_s > BEHIND_MAX_S {
            warn!(vehicle = %self.vehicle.id(), behind_s, "simulated time was lost: the host was asleep or is too slow");
            self.vehicle.skip_to(now);
            self.truth_due = now;
        }
        let target = now.min(self.vehicle.now().plus_secs_f64(CATCH_UP_S));
        while target.as_nanos() - self.vehicle.now().as_nanos() >= STEP_NS {
            let until = target.min(self.truth_due.max(self.vehicle.now() + Duration::from_nanos(STEP_NS as u64)));
            let water = &self.water;
            let elevation = |place: LocalPoint, stamp: Stamp| water.elevation_m(place.north_m, place.east_m, stamp);
            self.vehicle.advance(until, &elevation);
            if self.vehicle.now() + Duration::from_nanos(STEP_NS as u64) > self.truth_due {
                self.truth_due = self.truth_due.plus_secs_f64(TRUTH_EVERY_S).max(self.vehicle.now());
                self.truths.put(&self.vehicle.truth()).await?;
            }
        }
        Ok(())
    }

    /// Hands out what the autopilot says.
    fn speak(&mut self) {
        let Self { vehicle, clients, .. } = self;
        let mut gone: Vec<(LinkId, Gone)> = Vec::new();
        let said: Vec<_> = vehicle.take_outbox().collect();
        for (link, outbound) in said {
            for client in clients.iter_mut().filter(|client| link.is_none_or(|link| link == client.link)) {
                if let Err(why) = client.say(vehicle, &outbound) {
                    gone.push((client.link, why));
                }
            }
        }
        clients.retain_mut(|client| {
            let said = match gone.iter().find(|(link, _)| *link == client.link) {
                Some((_, why)) => Err(*why),
                None => client.flush(),
            };
            keep(vehicle, client.link, said)
        });
    }
}

/// Whether to keep a client; one that is gone is forgotten by the vehicle too.
fn keep(vehicle: &mut Vehicle, link: LinkId, outcome: Result<(), Gone>) -> bool {
    let Err(why) = outcome else { return true };
    debug!(vehicle = %vehicle.id(), link = link.0, %why, "a MAVLink client is gone");
    vehicle.detach(link);
    false
}
