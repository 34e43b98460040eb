-- title: Rows per table
-- description: How many rows each view has for a run, from hosts to links. Empty views are listed
--     too.
-- grain: one row per run and view
-- column: run_id
-- column: object VARCHAR     View that holds the rows
-- column: row_count BIGINT   Rows
WITH counted AS (
    SELECT
        r.run_id,
        unnest([
            'host', 'process', 'thread', 'node', 'publisher', 'subscription', 'timer',
            'service', 'client', 'action_server', 'action_client', 'callback', 'executor',
            'publication', 'take', 'callback_instance', 'request', 'response', 'goal',
            'link_transport', 'link_causal'
        ]) AS object,
        unnest(range(21)) AS position,
        unnest([
            (SELECT count(*) FROM main.host AS o WHERE o.run_id = r.run_id),
            (SELECT count(*) FROM main.process AS o WHERE o.run_id = r.run_id),
            (SELECT count(*) FROM main.thread AS o WHERE o.run_id = r.run_id),
            (SELECT count(*) FROM main.node AS o WHERE o.run_id = r.run_id),
            (SELECT count(*) FROM main.publisher AS o WHERE o.run_id = r.run_id),
            (SELECT count(*) FROM main.subscription AS o WHERE o.run_id = r.run_id),
            (SELECT count(*) FROM main.timer AS o WHERE o.run_id = r.run_id),
            (SELECT count(*) FROM main.service AS o WHERE o.run_id = r.run_id),
            (SELECT count(*) FROM main.client AS o WHERE o.run_id = r.run_id),
            (SELECT count(*) FROM main.action_server AS o WHERE o.run_id = r.run_id),
            (SELECT count(*) FROM main.action_client AS o WHERE o.run_id = r.run_id),
            (SELECT count(*) FROM main.callback AS o WHERE o.run_id = r.run_id),
            (SELECT count(*) FROM main.executor AS o WHERE o.run_id = r.run_id),
            (SELECT count(*) FROM main.publication AS o WHERE o.run_id = r.run_id),
            (SELECT count(*) FROM main.take AS o WHERE o.run_id = r.run_id),
            (SELECT count(*) FROM main.callback_instance AS o WHERE o.run_id = r.run_id),
            (SELECT count(*) FROM main.request AS o WHERE o.run_id = r.run_id),
            (SELECT count(*) FROM main.response AS o WHERE o.run_id = r.run_id),
            (SELECT count(*) FROM main.goal AS o WHERE o.run_id = r.run_id),
            (SELECT count(*) FROM main.link_transport AS o WHERE o.run_id = r.run_id),
            (SELECT count(*) FROM main.link_causal AS o WHERE o.run_id = r.run_id)
        ]) AS row_count
    FROM main.run AS r
    WHERE list_contains($runs, r.run_id)
)
SELECT run_id, object, row_count
FROM counted
ORDER BY run_id, position
