"""What several tests and the benchmarks share: processes, listeners, a scripted machine."""
