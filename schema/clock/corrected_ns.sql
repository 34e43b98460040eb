-- description: A time of some clock on the common time axis: its offset, and its drift since the
--     reference.
CREATE OR REPLACE MACRO derive.corrected_ns(time_ns, offset_ns, drift_ppb, reference_ns) AS
time_ns + offset_ns
+ CASE
    WHEN drift_ppb = 0 THEN 0
    ELSE round((time_ns - reference_ns)::DOUBLE * drift_ppb / 1e9)::BIGINT
END
