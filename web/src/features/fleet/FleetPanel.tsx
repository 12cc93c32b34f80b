/** Every vehicle: what it does, how high, how well. What is silent is grey and says so. */
import type { Vehicle } from '../../api/types';
import { age, fixKind, fixed, heading, length, percent, quantity, UNKNOWN } from '../../lib/format';
import { select, selection } from '../../lib/url-state';
import type { Heard } from '../../state/reduce';
import { fleetNow_ms, live, now_ms, vehicles } from '../../state/store';
import { Icon, type IconName } from '../../ui/Icon';
import { Panel } from '../../ui/Panel';
import { activityText, activityTone, age_s, batteryTone, firmwareText, fixTone, inOrder, linkText, presence, type Tone } from './describe';

export function FleetPanel() {
  const all = inOrder(Object.values(vehicles.value));
  return (
    <Panel title="Fleet" class="fleet" testid="fleet" aside={<span class="count">{all.length === 0 ? '' : `${all.length} vehicles`}</span>}>
      {all.length === 0 ? (
        <p class="empty">{live.value ? 'No vehicle has been heard yet. It appears here as soon as its link is up.' : 'Not connected: no vehicles are known.'}</p>
      ) : (
        <ul class="fleet-list">
          {all.map((heard) => (
            <VehicleRow key={heard.value.id} heard={heard} />
          ))}
        </ul>
      )}
    </Panel>
  );
}

function VehicleRow({ heard }: { heard: Heard<Vehicle> }) {
  const vehicle = heard.value;
  const seen = presence(heard, live.value, fleetNow_ms.value, now_ms.value);
  const open = selection.value.vehicle === vehicle.id;
  const old_s = age_s(vehicle, fleetNow_ms.value);
  const badge = seen === 'fresh' ? activityText(vehicle) : seen === 'stale' ? 'Silent' : 'Unknown';
  const speed_mps = Math.hypot(vehicle.velocity.north_mps, vehicle.velocity.east_mps);
  return (
    <li class={`vehicle ${vehicle.role} ${seen}`} data-testid={`vehicle-${vehicle.id}`} data-activity={vehicle.activity.kind}>
      <button class="vehicle-head" aria-expanded={open} onClick={() => select({ vehicle: open ? null : vehicle.id })}>
        <i class="role-mark" aria-hidden="true" />
        <span class="vehicle-name">
          <b>{vehicle.id}</b>
          <small>{vehicle.mode}{vehicle.armed ? ' · armed' : ''}</small>
        </span>
        <span class={`badge ${seen === 'fresh' ? activityTone(vehicle) : 'idle'}`}>{badge}</span>
      </button>
      {seen === 'fresh' && vehicle.activity.reason !== null && <p class="vehicle-reason">{vehicle.activity.reason}</p>}
      <dl class="vitals">
        <Vital icon="height" name="Height above water" value={length(vehicle.local.height_m)} />
        <Vital icon="battery" name="Battery" value={percent(vehicle.battery_percent)} tone={batteryTone(vehicle.battery_percent)} />
        <Vital icon="satellite" name="GNSS" value={vehicle.fix === null ? UNKNOWN : `${fixKind(vehicle.fix.kind)} ${vehicle.fix.satellites}`} tone={fixTone(vehicle)} />
        <Vital icon="link" name="Last heard" value={age(old_s)} tone={seen === 'fresh' ? 'ok' : 'bad'} />
      </dl>
      {open && (
        <dl class="details">
          <Detail name="Position" value={`N ${length(vehicle.local.north_m)}, E ${length(vehicle.local.east_m)}`} />
          <Detail name="Speed" value={quantity(speed_mps, 1, 'm/s')} />
          <Detail name="Climb" value={quantity(-vehicle.velocity.down_mps, 1, 'm/s')} />
          <Detail name="Heading" value={heading(vehicle.heading_deg)} />
          <Detail name="Slot error" value={length(vehicle.activity.slot_error_m)} />
          <Detail name="GNSS accuracy" value={quantity(vehicle.fix?.horizontal_sigma_m, 1, 'm')} />
          <Detail name="Voltage" value={quantity(vehicle.battery_v, 1, 'V')} />
          <Detail name="Rangefinder" value={quantity(vehicle.range_m, 2, 'm')} />
          <Detail name="Autopilot link" value={linkText(vehicle)} />
          <Detail name="Firmware" value={firmwareText(vehicle)} />
          <Detail name="Estimator" value={vehicle.estimator_ok ? 'good' : 'not good'} />
          <Detail name="Ready to arm" value={vehicle.ready_to_arm ? 'yes' : 'no'} />
          <Detail name="Plan" value={vehicle.plan_generation === 0 ? 'none' : `no. ${fixed(vehicle.plan_generation, 0)}`} />
        </dl>
      )}
    </li>
  );
}

function Vital({ icon, name, value, tone = 'idle' }: { icon: IconName; name: string; value: string; tone?: Tone }) {
  return (
    <div class={`vital tone-${tone}`} title={name}>
      <dt><Icon name={icon} size={16} /><span class="hidden">{name}</span></dt>
      <dd>{value}</dd>
    </div>
  );
}

const Detail = ({ name, value }: { name: string; value: string }) => (
  <div><dt>{name}</dt><dd>{value}</dd></div>
);
