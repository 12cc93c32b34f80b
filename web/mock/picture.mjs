/** A 320 × 240 picture of made-up water as BMP, so that the mock needs no encoder. */
const [WIDTH, HEIGHT] = [320, 240];

export function picture(t_s, kind) {
  const data = Buffer.alloc(54 + WIDTH * HEIGHT * 3);
  data.write('BM', 0);
  data.writeUInt32LE(data.length, 2);
  data.writeUInt32LE(54, 10);
  data.writeUInt32LE(40, 14);
  data.writeInt32LE(WIDTH, 18);
  data.writeInt32LE(HEIGHT, 22);
  data.writeUInt16LE(1, 26);
  data.writeUInt16LE(24, 28);
  for (let y = 0; y < HEIGHT; y += 1) {
    for (let x = 0; x < WIDTH; x += 1) {
      const waves = Math.sin(x / 17 + y / 29 + 2 * t_s) + 0.6 * Math.sin(x / 41 - y / 13 - 3 * t_s) + 0.3 * Math.sin(x / 5 + y / 4 + 5 * t_s);
      const level = (waves + 2) / 4;
      const at = 54 + (y * WIDTH + x) * 3;
      if (kind === 'left') {
        const grey = 60 + 120 * level;
        data.set([grey * 0.95, grey * 0.92, grey * 0.85], at);
      } else {
        data.set([255 * (1 - level), 200 * level * (1.5 - level), 255 * level * level], at);
      }
    }
  }
  return data;
}
