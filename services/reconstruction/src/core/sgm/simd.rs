//! One body, compiled for several instruction sets and chosen at run time. The only place with `unsafe`: calling a function that
//! was compiled for instructions which this processor might lack, after asking whether it has them.

#![allow(unsafe_code, reason = "a function with target features may be called only where they were found")]

use super::strip::{Job, Output, Workspace, run};

/// For which instructions the inner loops are compiled.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Simd {
    /// What every processor of the architecture has: SSE2 on x86-64, NEON on aarch64.
    Baseline,
    /// AVX2: 32 bytes at a time.
    Avx2,
    /// AVX-512 with byte operations and population counts of bytes (Ice Lake, Zen 4 and later): 64 bytes at a time.
    Avx512,
}

impl Simd {
    /// All, plainest first.
    pub const ALL: [Self; 3] = [Self::Baseline, Self::Avx2, Self::Avx512];

    /// Whether this processor has it.
    #[must_use]
    pub fn is_available(self) -> bool {
        match self {
            Self::Baseline => true,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => is_x86_feature_detected!("avx2"),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => {
                is_x86_feature_detected!("avx2")
                    && is_x86_feature_detected!("avx512f")
                    && is_x86_feature_detected!("avx512bw")
                    && is_x86_feature_detected!("avx512vl")
                    && is_x86_feature_detected!("avx512bitalg")
            }
            #[cfg(not(target_arch = "x86_64"))]
            Self::Avx2 | Self::Avx512 => false,
        }
    }

    /// The best that this processor has.
    #[must_use]
    pub fn best() -> Self {
        Self::ALL.into_iter().rev().find(|simd| simd.is_available()).unwrap_or(Self::Baseline)
    }

    /// Matches a strip. What the processor lacks is replaced by the baseline, which gives the same result.
    pub(super) fn run(self, job: &Job<'_>, workspace: &mut Workspace, output: Output<'_>) {
        match self {
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 if self.is_available() => {
                // SAFETY: the features were found.
                unsafe { run_avx512(job, workspace, output) }
            }
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 if self.is_available() => {
                // SAFETY: the feature was found.
                unsafe { run_avx2(job, workspace, output) }
            }
            _ => run(job, workspace, output),
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,avx512f,avx512bw,avx512vl,avx512bitalg")]
fn run_avx512(job: &Job<'_>, workspace: &mut Workspace, output: Output<'_>) {
    run(job, workspace, output);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn run_avx2(job: &Job<'_>, workspace: &mut Workspace, output: Output<'_>) {
    run(job, workspace, output);
}
