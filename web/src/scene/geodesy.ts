/** WGS-84 to the fleet's local frame and back, near its origin. The gateway does this exactly; the page needs it only for
 * homes, which come as latitude and longitude, and for showing a clicked place in both: the tangent plane's first-order
 * radii are good to a few centimetres within a kilometre. */
import type { Place } from './projection';

export interface LatLon {
  latitude_deg: number;
  longitude_deg: number;
}

const SEMI_MAJOR_M = 6_378_137;
const E2 = (2 - 1 / 298.257_223_563) / 298.257_223_563;
const RAD = Math.PI / 180;

/** Metres per degree of latitude and of longitude at a latitude: the meridian's and the parallel's radii. */
function metresPerDegree(latitude_deg: number): { north: number; east: number } {
  const [sin, cos] = [Math.sin(latitude_deg * RAD), Math.cos(latitude_deg * RAD)];
  const w2 = 1 - E2 * sin * sin;
  return { north: ((SEMI_MAJOR_M * (1 - E2)) / w2 ** 1.5) * RAD, east: (SEMI_MAJOR_M / Math.sqrt(w2)) * cos * RAD };
}

export function placeFromGlobal(origin: LatLon, global: LatLon): Place {
  // The radii half way between the two cancel most of the curvature.
  const m = metresPerDegree((origin.latitude_deg + global.latitude_deg) / 2);
  const around_deg = ((global.longitude_deg - origin.longitude_deg + 540) % 360) - 180;
  return { north_m: (global.latitude_deg - origin.latitude_deg) * m.north, east_m: around_deg * m.east };
}

export function globalFromPlace(origin: LatLon, place: Place): LatLon {
  const latitude_deg = origin.latitude_deg + place.north_m / metresPerDegree(origin.latitude_deg).north;
  const m = metresPerDegree((origin.latitude_deg + latitude_deg) / 2);
  return { latitude_deg: origin.latitude_deg + place.north_m / m.north, longitude_deg: origin.longitude_deg + place.east_m / m.east };
}
