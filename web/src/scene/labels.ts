/** Where labels go so that they do not cover each other: the first of four places around the symbol that is free. Pure. */
export interface Box {
  x: number;
  y: number;
  w: number;
  h: number;
}

const overlap = (a: Box, b: Box): boolean => a.x < b.x + b.w && b.x < a.x + a.w && a.y < b.y + b.h && b.y < a.y + a.h;

/** The box for a label of `w` × `h` beside a symbol of radius `r` at (`x`, `y`); `null` where all four places are taken. */
export function placeLabel(x: number, y: number, r: number, w: number, h: number, taken: readonly Box[]): Box | null {
  const gap = r + 6;
  const candidates: Box[] = [
    { x: x + gap, y: y - h / 2, w, h },
    { x: x - gap - w, y: y - h / 2, w, h },
    { x: x - w / 2, y: y + gap, w, h },
    { x: x - w / 2, y: y - gap - h, w, h },
  ];
  return candidates.find((box) => !taken.some((other) => overlap(box, other))) ?? null;
}
