/** A composition onto a 2-D canvas. Knows pixels and colours, decides nothing. */
import type { Composition, DrawnVehicle } from './compose';
import { placeLabel, type Box } from './labels';
import type { Palette } from './palette';
import { gridLines, niceLength_m, pixelFromPlace, placeFromPixel, type Pixel, type Place, type Size, type View } from './projection';
import type { Trails } from './trails';

const SYMBOL_PX = 13;
const FONT = 'ui-sans-serif, system-ui, "Segoe UI", "Noto Sans", "DejaVu Sans", sans-serif';
const TAU = 2 * Math.PI;

export interface Frame {
  ctx: CanvasRenderingContext2D;
  size: Size;
  view: View;
  palette: Palette;
}

export function draw(frame: Frame, scene: Composition, trails: Trails): void {
  const { ctx, size, palette } = frame;
  ctx.fillStyle = palette.water;
  ctx.fillRect(0, 0, size.width_px, size.height_px);
  drawGrid(frame);
  for (const vehicle of scene.vehicles) drawTrail(frame, trails[vehicle.id] ?? [], palette[vehicle.role]);
  for (const home of scene.homes) drawHome(frame, home);
  for (const ring of scene.rings) drawRing(frame, ring);
  for (const errand of scene.errands) line(frame, errand.from, errand.to, palette[errand.role], [3, 6]);
  for (const slot of scene.slots) drawSlot(frame, slot.place);
  const taken: Box[] = [...scene.vehicles.map((one) => one.place), ...scene.homes].map((place) => around(at(frame, place), SYMBOL_PX));
  for (const mission of scene.missions) drawTarget(frame, mission, taken);
  for (const touchdown of scene.touchdowns) drawTouchdown(frame, touchdown, taken);
  if (scene.draft !== null) drawDraft(frame, scene.draft, taken);
  // The selected one last, so that it lies on top; its label first, so that it finds room.
  const ordered = scene.vehicles.toSorted((a, b) => Number(b.selected) - Number(a.selected));
  for (const vehicle of ordered) drawLabel(frame, vehicle, taken);
  for (const vehicle of ordered.toReversed()) drawVehicle(frame, vehicle);
}

const at = (frame: Frame, place: Place): Pixel => pixelFromPlace(frame.view, frame.size, place);
const around = ({ x_px, y_px }: Pixel, r: number): Box => ({ x: x_px - r, y: y_px - r, w: 2 * r, h: 2 * r });

function drawGrid(frame: Frame): void {
  const { ctx, size, view, palette } = frame;
  const step_m = niceLength_m(view.px_per_m, 110);
  const [northWest, southEast] = [
    placeFromPixel(view, size, { x_px: 0, y_px: 0 }),
    placeFromPixel(view, size, { x_px: size.width_px, y_px: size.height_px }),
  ];
  ctx.lineWidth = 1;
  ctx.font = `11px ${FONT}`;
  ctx.fillStyle = palette.soft;
  const rule = (value_m: number, vertical: boolean): void => {
    const pixel = at(frame, { north_m: value_m, east_m: value_m });
    const where = Math.round(vertical ? pixel.x_px : pixel.y_px) + 0.5;
    ctx.strokeStyle = value_m === 0 ? palette.axis : palette.grid;
    ctx.beginPath();
    ctx.moveTo(vertical ? where : 0, vertical ? 0 : where);
    ctx.lineTo(vertical ? where : size.width_px, vertical ? size.height_px : where);
    ctx.stroke();
    const text = `${Number(value_m.toPrecision(6))}`.replace('-', '\u2212');
    if (vertical) ctx.fillText(text, where + 4, 14);
    else if (where > 30 && where < size.height_px - 45) ctx.fillText(text, 6, where - 4);
  };
  for (const east_m of gridLines(northWest.east_m, southEast.east_m, step_m)) rule(east_m, true);
  for (const north_m of gridLines(southEast.north_m, northWest.north_m, step_m)) rule(north_m, false);
}

function drawTrail(frame: Frame, trail: readonly Place[], colour: string): void {
  const { ctx } = frame;
  if (trail.length < 2) return;
  ctx.strokeStyle = colour;
  ctx.lineWidth = 2;
  ctx.lineJoin = 'round';
  // Older is fainter, in eight strokes rather than hundreds.
  const bands = 8;
  for (let band = 0; band < bands; band += 1) {
    const from = Math.floor((trail.length * band) / bands);
    const part = trail.slice(from, Math.floor((trail.length * (band + 1)) / bands) + 1);
    ctx.globalAlpha = 0.08 + (0.5 * (band + 1)) / bands;
    ctx.beginPath();
    part.forEach((place, i) => {
      const { x_px, y_px } = at(frame, place);
      if (i === 0) ctx.moveTo(x_px, y_px);
      else ctx.lineTo(x_px, y_px);
    });
    ctx.stroke();
  }
  ctx.globalAlpha = 1;
}

function line(frame: Frame, from: Place, to: Place, colour: string, dash: number[]): void {
  const { ctx } = frame;
  const [a, b] = [at(frame, from), at(frame, to)];
  ctx.strokeStyle = colour;
  ctx.lineWidth = 1.5;
  ctx.setLineDash(dash);
  ctx.beginPath();
  ctx.moveTo(a.x_px, a.y_px);
  ctx.lineTo(b.x_px, b.y_px);
  ctx.stroke();
  ctx.setLineDash([]);
}

function circle(frame: Frame, { x_px, y_px }: Pixel, r: number): void {
  frame.ctx.beginPath();
  frame.ctx.arc(x_px, y_px, r, 0, TAU);
}

function drawHome(frame: Frame, place: Place): void {
  const { ctx, palette } = frame;
  const { x_px, y_px } = at(frame, place);
  ctx.strokeStyle = palette.soft;
  ctx.lineWidth = 1.5;
  ctx.beginPath();
  ctx.roundRect(x_px - 8, y_px - 8, 16, 16, 3);
  ctx.stroke();
  ctx.font = `600 10px ${FONT}`;
  ctx.fillStyle = palette.soft;
  ctx.textAlign = 'center';
  ctx.textBaseline = 'middle';
  ctx.fillText('H', x_px, y_px + 0.5);
  ctx.textAlign = 'start';
  ctx.textBaseline = 'alphabetic';
}

function drawRing(frame: Frame, ring: Composition['rings'][number]): void {
  const { ctx, palette, view } = frame;
  const r = ring.radius_m * view.px_per_m;
  if (r < SYMBOL_PX) return;
  circle(frame, at(frame, ring.place), r);
  ctx.strokeStyle = ring.close ? palette.unsafe : palette.axis;
  ctx.lineWidth = ring.close ? 2.5 : 1;
  ctx.setLineDash(ring.close ? [] : [2, 5]);
  ctx.stroke();
  ctx.setLineDash([]);
}

function drawSlot(frame: Frame, place: Place): void {
  const { ctx, palette } = frame;
  circle(frame, at(frame, place), SYMBOL_PX + 5);
  ctx.strokeStyle = palette.follower;
  ctx.lineWidth = 2;
  ctx.setLineDash([5, 4]);
  ctx.stroke();
  ctx.setLineDash([]);
}

function drawTarget(frame: Frame, mission: Composition['missions'][number], taken: Box[]): void {
  const { ctx, palette } = frame;
  const pixel = at(frame, mission.place);
  const selected = mission.state === 'selected';
  ctx.strokeStyle = mission.tone === null ? (selected ? palette.ink : palette.soft) : palette[mission.tone];
  ctx.lineWidth = mission.tone === null ? (selected ? 2 : 1.5) : 3;
  for (const r of [4, 11]) {
    circle(frame, pixel, r);
    ctx.stroke();
  }
  crosshair(frame, pixel, 7, 17);
  label(frame, pixel, 17, [mission.name], taken, [selected ? palette.ink : palette.soft]);
}

function crosshair({ ctx }: Frame, { x_px, y_px }: Pixel, inner: number, outer: number): void {
  ctx.beginPath();
  for (const [dx, dy] of [[1, 0], [-1, 0], [0, 1], [0, -1]] as const) {
    ctx.moveTo(x_px + dx * inner, y_px + dy * inner);
    ctx.lineTo(x_px + dx * outer, y_px + dy * outer);
  }
  ctx.stroke();
}

function drawDraft(frame: Frame, place: Place, taken: Box[]): void {
  const { ctx, palette } = frame;
  const pixel = at(frame, place);
  ctx.strokeStyle = palette.accent;
  ctx.lineWidth = 2.5;
  ctx.setLineDash([5, 4]);
  circle(frame, pixel, 15);
  ctx.stroke();
  ctx.setLineDash([]);
  crosshair(frame, pixel, 4, 22);
  label(frame, pixel, 22, ['New mission'], taken, [palette.accent]);
}

function drawTouchdown(frame: Frame, touchdown: Composition['touchdowns'][number], taken: Box[]): void {
  const { ctx, palette } = frame;
  const pixel = at(frame, touchdown.place);
  ctx.strokeStyle = palette.safe;
  ctx.lineWidth = 3;
  ctx.beginPath();
  for (const sign of [1, -1]) {
    ctx.moveTo(pixel.x_px - 6, pixel.y_px - 6 * sign);
    ctx.lineTo(pixel.x_px + 6, pixel.y_px + 6 * sign);
  }
  ctx.stroke();
  label(frame, pixel, 17, [touchdown.caption], taken, [palette.safe]);
}

function colourOf(vehicle: DrawnVehicle, palette: Palette): string {
  if (vehicle.presence !== 'fresh') return palette.idle;
  return vehicle.alarm ? palette.unsafe : palette[vehicle.role];
}

function drawVehicle(frame: Frame, vehicle: DrawnVehicle): void {
  const { ctx, palette } = frame;
  const { x_px, y_px } = at(frame, vehicle.place);
  const colour = colourOf(vehicle, palette);
  if (vehicle.selected) {
    circle(frame, { x_px, y_px }, SYMBOL_PX + 7);
    ctx.strokeStyle = colour;
    ctx.lineWidth = 2.5;
    ctx.stroke();
  }
  ctx.save();
  ctx.translate(x_px, y_px);
  ctx.rotate((vehicle.heading_deg * Math.PI) / 180);
  ctx.beginPath();
  ctx.moveTo(0, -SYMBOL_PX);
  ctx.lineTo(SYMBOL_PX * 0.72, SYMBOL_PX * 0.8);
  ctx.lineTo(0, SYMBOL_PX * 0.42);
  ctx.lineTo(-SYMBOL_PX * 0.72, SYMBOL_PX * 0.8);
  ctx.closePath();
  ctx.lineJoin = 'round';
  ctx.lineWidth = 5;
  ctx.strokeStyle = palette.halo;
  ctx.stroke();
  // Filled in the air, hollow on the ground.
  ctx.fillStyle = vehicle.airborne ? colour : palette.halo;
  ctx.fill();
  ctx.lineWidth = 2;
  ctx.strokeStyle = colour;
  if (vehicle.presence !== 'fresh') ctx.setLineDash([3, 2]);
  ctx.stroke();
  ctx.setLineDash([]);
  // The role also by shape: a leader has its two cameras, a follower its payload.
  ctx.fillStyle = vehicle.airborne ? palette.halo : colour;
  if (vehicle.role === 'leader') {
    for (const x of [-2.6, 2.6]) {
      ctx.beginPath();
      ctx.arc(x, 0.5, 1.9, 0, TAU);
      ctx.fill();
    }
  } else {
    ctx.fillRect(-2.6, -2, 5.2, 5.2);
  }
  ctx.restore();
}

function drawLabel(frame: Frame, vehicle: DrawnVehicle, taken: Box[]): void {
  const colour = colourOf(vehicle, frame.palette);
  const lines = [vehicle.id, vehicle.caption];
  const pixel = at(frame, vehicle.place);
  if (!label(frame, pixel, SYMBOL_PX + 2, lines, taken, [colour, frame.palette.ink])) {
    label(frame, pixel, SYMBOL_PX + 2, [vehicle.id], taken, [colour]);
  }
}

/** Up to two lines on a plate beside a symbol; `false` where there is no room. */
function label(frame: Frame, { x_px, y_px }: Pixel, r: number, lines: string[], taken: Box[], colours: string[]): boolean {
  const { ctx, palette } = frame;
  const font = (i: number): string => `${i === 0 ? 650 : 450} 12px ${FONT}`;
  const width = Math.max(...lines.map((text, i) => ((ctx.font = font(i)), ctx.measureText(text).width))) + 10;
  const height = lines.length * 15 + 4;
  const box = placeLabel(x_px, y_px, r, width, height, taken);
  if (box === null) return false;
  taken.push(box);
  ctx.globalAlpha = 0.82;
  ctx.fillStyle = palette.halo;
  ctx.beginPath();
  ctx.roundRect(box.x, box.y, box.w, box.h, 5);
  ctx.fill();
  ctx.globalAlpha = 1;
  lines.forEach((text, i) => {
    ctx.font = font(i);
    ctx.fillStyle = colours[i] ?? palette.ink;
    ctx.fillText(text, box.x + 5, box.y + 13.5 + i * 15);
  });
  return true;
}
