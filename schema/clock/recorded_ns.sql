-- description: What a clock showed at a time of the common axis: the inverse of
--     derive.corrected_ns.
CREATE OR REPLACE MACRO derive.recorded_ns(time_ns, offset_ns, drift_ppb, reference_ns) AS
time_ns - offset_ns
- CASE
    WHEN drift_ppb = 0 THEN 0
    ELSE round(
        (time_ns - offset_ns - reference_ns)::DOUBLE * (drift_ppb / (1e9 + drift_ppb))
    )::BIGINT
END
