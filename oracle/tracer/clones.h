// Functions of which the compiler makes one version for all processors and one for those with wide vectors; the loader
// chooses. Results are the same, as no multiplications and additions are fused.
#pragma once

#if defined(__GNUC__) && !defined(__clang__) && defined(__x86_64__) && defined(__linux__) && !defined(__SANITIZE_ADDRESS__)
#define ORACLE_FOR_WIDE_VECTORS __attribute__((target_clones("avx2", "default")))
#else
#define ORACLE_FOR_WIDE_VECTORS
#endif

// Before a loop whose iterations do not touch each other's data.
#if defined(__clang__)
#define ORACLE_INDEPENDENT _Pragma("clang loop vectorize(assume_safety)")
#elif defined(__GNUC__)
#define ORACLE_INDEPENDENT _Pragma("GCC ivdep")
#else
#define ORACLE_INDEPENDENT
#endif
