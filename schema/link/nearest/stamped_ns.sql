-- description: When a message was stamped, by the clock of the trace, given its stamp and a row of
--     store.stamp_clock.
CREATE OR REPLACE MACRO derive.stamped_ns(stamp_ns, at_ns, difference_ns, drift_ppb) AS
    stamp_ns - difference_ns - ((stamp_ns - at_ns)::DOUBLE * drift_ppb / 1e9)::BIGINT
