-- description: Things worth knowing about the input or the recording before trusting a number: lost
--     events, objects not seen to be created, clocks apart.
-- grain: one row per place at which something was found
-- column: run_id, trace_id, name
-- column: phase VARCHAR  What it is about: 'input' or 'recording'
-- column: severity VARCHAR  'error' where results are wrong or missing, 'warning' where they may
--     be, or 'info'
-- column: host_id BIGINT  Host it is about, or that of its process; NULL: not one host alone
-- column: process_id BIGINT  Process it is about, or that of its thread or node
-- column: thread_id
-- column: node_id
-- column: publishing_node_id
-- column: topic_name
-- column: layer
-- column: subject VARCHAR  Where, in words: a trace, process, host, node, topic
-- column: count
-- column: detail
-- column: cause, cure, title
-- column: description VARCHAR  What it means for results
SELECT
    f.run_id, f.trace_id, f.name, k.phase, k.severity, h.host_id, p.process_id, f.thread_id,
    f.node_id, f.publishing_node_id, f.topic_name, f.layer,
    coalesce(
        f.subject,
        n.full_name,
        printf('%s %d on %s', coalesce(d.name, '?'), d.tid, h.hostname),
        printf('%s %d on %s', coalesce(p.name, '?'), p.pid, h.hostname),
        f.topic_name, h.hostname, f.layer, t.path, 'the ' || k.phase
    ) AS subject,
    f.count, f.detail, k.cause, k.cure, k.title, k.description
FROM store.finding AS f
JOIN derive.finding_kind AS k ON f.name = k.name
LEFT JOIN store.trace AS t ON f.trace_id = t.trace_id
LEFT JOIN store.node AS n ON f.node_id = n.node_id
LEFT JOIN store.thread AS d ON f.thread_id = d.thread_id
LEFT JOIN store.process AS p
    ON coalesce(f.process_id, d.process_id, n.process_id) = p.process_id
LEFT JOIN store.host AS h ON coalesce(f.host_id, p.host_id) = h.host_id
