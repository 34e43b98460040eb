-- description: How durations are spread, in columns: unnest(main.spread(duration_ns)) gives min_ns,
--     median_ns, mean_ns, p95_ns, p99_ns and max_ns. Quantiles are values that occurred.
-- param: duration_ns BIGINT  Durations of a group
CREATE OR REPLACE MACRO main.spread(duration_ns) AS {
    'min_ns': min(duration_ns),
    'median_ns': quantile_disc(duration_ns, [0.5, 0.95, 0.99])[1],
    'mean_ns': round(avg(duration_ns))::BIGINT,
    'p95_ns': quantile_disc(duration_ns, [0.5, 0.95, 0.99])[2],
    'p99_ns': quantile_disc(duration_ns, [0.5, 0.95, 0.99])[3],
    'max_ns': max(duration_ns)
}
