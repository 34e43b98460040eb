-- description: What a clock showed at a time of the common axis: the inverse of
--     derive.corrected_ns.
CREATE OR REPLACE MACRO derive.recorded_ns(time_ns, clock) AS
time_ns - clock.offset_ns
- CASE
    WHEN clock.drift_ppb = 0 THEN 0
    ELSE round(
        (time_ns - clock.offset_ns - clock.reference_ns)::DOUBLE
        * (clock.drift_ppb / (1e9 + clock.drift_ppb))
    )::BIGINT
END
