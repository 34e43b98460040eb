-- title: Data quality: what is missing, and what share of the answers it affects
-- description: What the traces lack, by trace, process and topic. `affected` of `total` things of a
--     kind are affected: events that were discarded, time in gaps, callback instances without an
--     end, objects whose creation was not recorded (without those of ROS itself), takes without a
--     publication, messages with an unknown fate, and links that lost events may have spoilt. The
--     last rows give the share of the whole run, also where it is 0.
-- grain: one row per trace, process, topic or run, and measure
-- param: all BOOLEAN = false     Also show measures with nothing affected
-- column: run_id
-- column: scope VARCHAR          'trace', 'process', 'topic' or 'run'
-- column: subject VARCHAR        Path of the trace, process and host, topic, or name of the run
-- column: measure VARCHAR        What is counted
-- column: affected BIGINT        How many are affected; for gap_time: nanoseconds in gaps
-- column: total BIGINT           How many there are; for gap_time: nanoseconds traced
-- column: affected_percent DOUBLE [%]  Share affected
-- column: is_internal
-- brief: scope, subject, measure, affected (even 0), total, affected_percent
WITH gap_edge AS (
    SELECT
        run_id, trace_id, start_ns, end_ns,
        max(end_ns) OVER (
            PARTITION BY run_id, trace_id ORDER BY start_ns, end_ns
            ROWS BETWEEN UNBOUNDED PRECEDING AND 1 PRECEDING
        ) AS covered_until_ns
    FROM main.gap
),
gap AS (
    SELECT
        run_id, trace_id,
        count(*) AS gap_count,
        sum(greatest(end_ns - greatest(start_ns, coalesce(covered_until_ns, start_ns)), 0))::BIGINT
            AS gap_ns
    FROM gap_edge
    GROUP BY run_id, trace_id
),
object AS (
    SELECT process_id, is_inferred FROM main.node
    UNION ALL
    SELECT process_id, is_inferred FROM main.publisher WHERE NOT is_internal
    UNION ALL
    SELECT process_id, is_inferred FROM main.subscription WHERE NOT is_internal
    UNION ALL
    SELECT
        process_id,
        kind = 'unknown'
    FROM main.callback
),
by_process AS (
    SELECT
        process_id,
        'open_callbacks' AS measure,
        count_if(end_ns IS NULL) AS affected,
        count(*) AS total
    FROM main.callback_instance
    GROUP BY process_id
    UNION ALL
    SELECT
        process_id, 'loss_affected_callbacks',
        count_if(is_loss_affected),
        count(*)
    FROM main.callback_instance
    GROUP BY process_id
    UNION ALL
    SELECT
        process_id, 'placeholders',
        count_if(is_inferred),
        count(*)
    FROM object
    GROUP BY process_id
),
by_topic AS (
    SELECT
        t.run_id, s.topic_name,
        'orphan_takes' AS measure,
        count(o.take_id) AS affected,
        count(*) AS total,
        bool_or(s.is_internal) AS is_internal
    FROM main.take AS t
    LEFT JOIN main.subscription AS s ON t.subscription_id = s.subscription_id
    LEFT JOIN main.stat_orphan AS o ON t.take_id = o.take_id
    GROUP BY t.run_id, s.topic_name
    UNION ALL
    SELECT
        d.run_id, s.topic_name, 'unknown_deliveries',
        count_if(d.status = 'unknown'),
        count(*),
        bool_or(s.is_internal)
    FROM main.stat_delivery AS d
    JOIN main.subscription AS s ON d.subscription_id = s.subscription_id
    GROUP BY d.run_id, s.topic_name
),
by_run AS (
    SELECT
        run_id,
        'loss_affected_transport_links' AS measure,
        count_if(is_loss_affected) AS affected,
        count(*) AS total
    FROM main.link_transport
    GROUP BY run_id
    UNION ALL
    SELECT
        run_id, 'ambiguous_transport_links',
        count_if(coalesce(candidate_count > 1, false)),
        count(*)
    FROM main.link_transport
    GROUP BY run_id
    UNION ALL
    SELECT
        run_id, 'loss_affected_causal_links',
        count_if(is_loss_affected),
        count(*)
    FROM main.link_causal
    GROUP BY run_id
    UNION ALL
    SELECT
        run_id, measure,
        sum(affected),
        sum(total)
    FROM by_topic
    GROUP BY run_id, measure
),
measured AS (
    SELECT
        t.run_id, 1 AS position,
        'trace' AS scope,
        t.path AS subject,
        'discarded_events' AS measure,
        coalesce(t.discarded_event_count, 0) AS affected,
        t.event_count + coalesce(t.discarded_event_count, 0) AS total,
        false AS is_internal
    FROM main.trace AS t
    UNION ALL
    SELECT
        t.run_id, 1, 'trace', t.path, 'gap_time',
        coalesce(g.gap_ns, 0),
        t.end_ns - t.start_ns,
        false
    FROM main.trace AS t
    LEFT JOIN gap AS g ON t.trace_id = g.trace_id
    UNION ALL
    SELECT
        p.run_id, 2, 'process',
        printf('%s %d on %s', coalesce(p.name, '?'), p.pid, h.hostname),
        b.measure, b.affected, b.total, false
    FROM by_process AS b
    JOIN main.process AS p ON b.process_id = p.process_id
    JOIN main.host AS h ON p.host_id = h.host_id
    UNION ALL
    SELECT
        run_id, 3, 'topic',
        coalesce(topic_name, '?'),
        measure, affected, total,
        coalesce(is_internal, false)
    FROM by_topic
    UNION ALL
    SELECT b.run_id, 4, 'run', r.name, b.measure, b.affected, b.total, false
    FROM by_run AS b
    JOIN main.run AS r ON b.run_id = r.run_id
)
SELECT
    run_id, scope, subject, measure,
    affected::BIGINT AS affected,
    total::BIGINT AS total,
    100 * affected / nullif(total, 0) AS affected_percent,
    is_internal
FROM measured
WHERE list_contains($runs, run_id) AND (affected > 0 OR $all OR scope = 'run')
ORDER BY run_id, position, subject, measure, affected, total
