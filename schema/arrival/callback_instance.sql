-- kind: inline
-- description: Callback instances with their CPU time, which is no longer than they are: a clock
--     is read a moment beside the event.
-- grain: one row per callback instance
SELECT
    i.*,
    CASE WHEN c.cpu_ns IS NOT NULL THEN least(c.cpu_ns, i.end_ns - i.start_ns) END AS cpu_ns,
    c.cpu_source
FROM staging.callback_extent AS i
LEFT JOIN staging.callback_cpu AS c ON i.callback_instance_id = c.callback_instance_id
