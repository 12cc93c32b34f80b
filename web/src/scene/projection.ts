/**
 * The map's geometry, pure. World: the fleet's local frame, metres north and east. Screen: CSS pixels, x right, y down,
 * north up. A view is a centre and a scale, nothing else.
 */

/** A place in the local frame, metres. */
export interface Place {
  north_m: number;
  east_m: number;
}

/** A place on the screen, CSS pixels from the map's top left corner. */
export interface Pixel {
  x_px: number;
  y_px: number;
}

/** Size of the map on the screen, CSS pixels. */
export interface Size {
  width_px: number;
  height_px: number;
}

/** What part of the world the map shows. */
export interface View {
  centre: Place;
  px_per_m: number;
}

/** Limits of zooming: from 20 km across a laptop's map to a hand's breadth. */
export const PX_PER_M_MIN = 0.05;
export const PX_PER_M_MAX = 200;

const clampScale = (px_per_m: number): number => Math.min(PX_PER_M_MAX, Math.max(PX_PER_M_MIN, px_per_m));

export function pixelFromPlace(view: View, size: Size, place: Place): Pixel {
  return {
    x_px: size.width_px / 2 + (place.east_m - view.centre.east_m) * view.px_per_m,
    y_px: size.height_px / 2 - (place.north_m - view.centre.north_m) * view.px_per_m,
  };
}

/** The inverse of {@link pixelFromPlace}. */
export function placeFromPixel(view: View, size: Size, pixel: Pixel): Place {
  return {
    east_m: view.centre.east_m + (pixel.x_px - size.width_px / 2) / view.px_per_m,
    north_m: view.centre.north_m - (pixel.y_px - size.height_px / 2) / view.px_per_m,
  };
}

/** The view after dragging the world by so many pixels. */
export function pan(view: View, right_px: number, down_px: number): View {
  return {
    ...view,
    centre: {
      north_m: view.centre.north_m + down_px / view.px_per_m,
      east_m: view.centre.east_m - right_px / view.px_per_m,
    },
  };
}

/** Zooms by `factor`; what lies under `anchor` stays under it. */
export function zoom(view: View, size: Size, anchor: Pixel, factor: number): View {
  const px_per_m = clampScale(view.px_per_m * factor);
  const under = placeFromPixel(view, size, anchor);
  return {
    px_per_m,
    centre: {
      east_m: under.east_m - (anchor.x_px - size.width_px / 2) / px_per_m,
      north_m: under.north_m + (anchor.y_px - size.height_px / 2) / px_per_m,
    },
  };
}

/** A view that shows all `places` with a margin, never tighter than `least_m` across; `null` for none. */
export function fit(size: Size, places: readonly Place[], margin_px = 64, least_m = 40): View | null {
  const sound = places.filter((place) => Number.isFinite(place.north_m) && Number.isFinite(place.east_m));
  if (sound.length === 0 || size.width_px <= 0 || size.height_px <= 0) return null;
  const norths = sound.map((place) => place.north_m);
  const easts = sound.map((place) => place.east_m);
  const [south, north, west, east] = [Math.min(...norths), Math.max(...norths), Math.min(...easts), Math.max(...easts)];
  const room = (extent_px: number): number => Math.max(extent_px - 2 * margin_px, extent_px / 4);
  const px_per_m = clampScale(
    Math.min(room(size.width_px) / Math.max(east - west, least_m), room(size.height_px) / Math.max(north - south, least_m)),
  );
  return { centre: { north_m: (south + north) / 2, east_m: (west + east) / 2 }, px_per_m };
}

/** The largest of 1, 2, 5 × 10ⁿ metres that is at most `width_px` long on the screen. */
export function niceLength_m(px_per_m: number, width_px: number): number {
  const longest_m = width_px / px_per_m;
  const power = 10 ** Math.floor(Math.log10(longest_m));
  const lead = longest_m / power;
  // A hair of tolerance: 5 × 10ⁿ computed in floating point may come out just under 5.
  return (lead >= 5 - 1e-9 ? 5 : lead >= 2 - 1e-9 ? 2 : 1) * power;
}

/** Multiples of `step_m` within [`from_m`, `to_m`]; empty rather than endless for a senseless step. */
export function gridLines(from_m: number, to_m: number, step_m: number): number[] {
  const count = Math.floor(to_m / step_m) - Math.ceil(from_m / step_m) + 1;
  if (!(step_m > 0) || !(count > 0) || count > 1000) return [];
  const first = Math.ceil(from_m / step_m);
  return Array.from({ length: count }, (_, i) => (first + i) * step_m);
}

/** A place in a leader's heading frame (thesis 6-1 … 6-8 for line abreast): metres ahead and to the right. */
export function slotPlace(leader: Place, heading_deg: number, forward_m: number, right_m: number): Place {
  const heading_rad = (heading_deg * Math.PI) / 180;
  const [sin, cos] = [Math.sin(heading_rad), Math.cos(heading_rad)];
  return {
    north_m: leader.north_m + forward_m * cos - right_m * sin,
    east_m: leader.east_m + forward_m * sin + right_m * cos,
  };
}

/** Horizontal distance, metres. */
export const distance_m = (a: Place, b: Place): number => Math.hypot(a.north_m - b.north_m, a.east_m - b.east_m);

/** Direction from `a` to `b`, degrees clockwise from north in [0, 360). */
export function bearing_deg(a: Place, b: Place): number {
  const deg = (Math.atan2(b.east_m - a.east_m, b.north_m - a.north_m) * 180) / Math.PI;
  return (deg + 360) % 360;
}
