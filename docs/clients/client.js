// A client of ggxref's vectors in JavaScript (Node), without dependencies.
//   ggxref grade --command 'node client.js' --functions ndf.ggx,fresnel.schlick --dtypes f32,f64
// Questions come on standard input, a header and then a line a test; answers go to standard output.
"use strict";
const view = new DataView(new ArrayBuffer(8));

const number = {
  f32: (word) => (view.setUint32(0, parseInt(word, 16)), view.getFloat32(0)),
  f64: (word) => (view.setBigUint64(0, BigInt("0x" + word)), view.getFloat64(0)),
};
const bits = {
  f32: (x) => (view.setFloat32(0, x), view.getUint32(0).toString(16).padStart(8, "0")),
  f64: (x) => (view.setFloat64(0, x), view.getBigUint64(0).toString(16).padStart(16, "0")),
};

// The formulas under test, of the arguments' numbers in the order of the vectors' file: put your own here.
const formulas = {
  "ndf.ggx": ([x, y, z, ax, ay]) => {
    if (z <= 0) return 0;
    const q = (x / ax) ** 2 + (y / ay) ** 2 + z * z;
    return 1 / (Math.PI * (ax * q) * (ay * q));
  },
  "fresnel.schlick": ([c, f0]) => f0 + (1 - f0) * (1 - Math.abs(c)) ** 5,
};

let name, dtype;
const answers = [];
for (const line of require("fs").readFileSync(0, "ascii").split("\n")) {
  const words = line.split(" ");
  if (words[0] === "ggxref-text-1") {
    [, name, dtype] = words;
    answers.push(`${name} ${dtype}`);
  } else if (line && formulas[name] && number[dtype]) {
    answers.push(`${words[0]} ${bits[dtype](formulas[name](words.slice(1).map(number[dtype])))}`);
  }
}
process.stdout.write(answers.join("\n") + "\n");
