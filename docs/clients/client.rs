// A client of ggxref's vectors in Rust, without dependencies.
//   rustc -O -o client client.rs
//   ggxref grade --command ./client --functions ndf.ggx,masking.lambda_ggx --dtypes f32,f64
// Questions come on standard input, a header and then a line a test; answers go to standard output.
use std::io::{self, BufRead, Write};

// The formulas under test, once for each float type: put your own here.
macro_rules! formulas {
    ($name:ident, $float:ty) => {
        mod $name {
            pub fn ggx(m: &[$float], alpha: &[$float]) -> $float {
                // A NaN must show, or be refused: it is not below the horizon.
                if m[2] <= 0.0 {
                    return 0.0;
                }
                let (x, y) = (m[0] / alpha[0], m[1] / alpha[1]);
                let q = x * x + y * y + m[2] * m[2];
                1.0 / (3.14159265358979323846 * (alpha[0] * q) * (alpha[1] * q))
            }

            pub fn lambda(w: &[$float], alpha: &[$float]) -> $float {
                let (x, y, z) = (alpha[0] * w[0], alpha[1] * w[1], w[2].abs());
                let square = x * x + y * y;
                // (sqrt(1 + a^2) - 1) / 2 cancels for small a.
                square / (2.0 * z * (z + (square + z * z).sqrt()))
            }

            pub fn answer(function: &str, x: &[$float]) -> Option<$float> {
                match function {
                    "ndf.ggx" => Some(ggx(&x[0..3], &x[3..5])),
                    "masking.lambda_ggx" => Some(lambda(&x[0..3], &x[3..5])),
                    _ => None,
                }
            }
        }
    };
}
formulas!(single, f32);
formulas!(double, f64);

fn answer(function: &str, dtype: &str, words: &[&str]) -> Option<String> {
    match dtype {
        "f32" => {
            let bits = |w: &&str| f32::from_bits(u32::from_str_radix(w, 16).unwrap());
            let x: Vec<f32> = words.iter().map(bits).collect();
            single::answer(function, &x).map(|y| format!("{:08x}", y.to_bits()))
        }
        "f64" => {
            let bits = |w: &&str| f64::from_bits(u64::from_str_radix(w, 16).unwrap());
            let x: Vec<f64> = words.iter().map(bits).collect();
            double::answer(function, &x).map(|y| format!("{:016x}", y.to_bits()))
        }
        _ => None,
    }
}

fn main() -> io::Result<()> {
    let mut out = io::BufWriter::new(io::stdout().lock());
    let (mut function, mut dtype) = (String::new(), String::new());
    for line in io::stdin().lock().lines() {
        let line = line?;
        let words: Vec<&str> = line.split_whitespace().collect();
        if words[0] == "ggxref-text-1" {
            (function, dtype) = (words[1].to_string(), words[2].to_string());
            writeln!(out, "{function} {dtype}")?;
        } else if let Some(bits) = answer(&function, &dtype, &words[1..]) {
            writeln!(out, "{} {bits}", words[0])?;
        }
    }
    out.flush()
}
