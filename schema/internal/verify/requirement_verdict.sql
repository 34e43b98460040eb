-- title: Requirements
-- description: Whether a run meets its requirements: what was judged, failures first. Otherwise the
--     order of the file stays.
-- grain: one row per requirement and thing that it is of
-- reads: judged
-- column: verdict VARCHAR         'passed', 'failed', 'not measured' or 'no data'
-- column: target VARCHAR          What the file calls it
-- column: subject VARCHAR         What of the run it is; NULL: nothing there
-- column: metric VARCHAR          What is required
-- column: condition VARCHAR       As it was written
-- column: measured VARCHAR        What was measured, for people
-- column: value DOUBLE            What was measured, in `unit`
-- column: unit VARCHAR            'ns', 'Hz', 'share' (0 to 1) or 'count'
-- column: samples BIGINT          How many values it is from
-- column: reason VARCHAR          Why there is no value, or why it may be wrong
-- column: worst_ns BIGINT [ns]    The worst case of what is too long or lost
-- column: worst_at_ns BIGINT [epoch ns]  When that began
-- column: see VARCHAR             The command that shows it
-- column: line BIGINT             Line of the file
-- column: path VARCHAR            Nodes and topics of a path
-- brief: verdict, subject, metric, condition, measured, reason, worst_ns, see, worst_at_ns, target,
--     samples, line, path, value
SELECT
    verdict, target, subject, metric, condition, measured, value, unit, samples, reason, worst_ns,
    worst_at_ns, see, line, path
FROM (
    SELECT
        *,
        row_number() OVER () AS place
    FROM judged
)
ORDER BY list_position(['failed', 'not measured', 'no data', 'passed'], verdict), place
