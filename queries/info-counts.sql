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
            (SELECT count(*) FROM main.host WHERE run_id = r.run_id),
            (SELECT count(*) FROM main.process WHERE run_id = r.run_id),
            (SELECT count(*) FROM main.thread WHERE run_id = r.run_id),
            (SELECT count(*) FROM main.node WHERE run_id = r.run_id),
            (SELECT count(*) FROM main.publisher WHERE run_id = r.run_id),
            (SELECT count(*) FROM main.subscription WHERE run_id = r.run_id),
            (SELECT count(*) FROM main.timer WHERE run_id = r.run_id),
            (SELECT count(*) FROM main.service WHERE run_id = r.run_id),
            (SELECT count(*) FROM main.client WHERE run_id = r.run_id),
            (SELECT count(*) FROM main.action_server WHERE run_id = r.run_id),
            (SELECT count(*) FROM main.action_client WHERE run_id = r.run_id),
            (SELECT count(*) FROM main.callback WHERE run_id = r.run_id),
            (SELECT count(*) FROM main.executor WHERE run_id = r.run_id),
            (SELECT count(*) FROM main.publication WHERE run_id = r.run_id),
            (SELECT count(*) FROM main.take WHERE run_id = r.run_id),
            (SELECT count(*) FROM main.callback_instance WHERE run_id = r.run_id),
            (SELECT count(*) FROM main.request WHERE run_id = r.run_id),
            (SELECT count(*) FROM main.response WHERE run_id = r.run_id),
            (SELECT count(*) FROM main.goal WHERE run_id = r.run_id),
            (SELECT count(*) FROM main.link_transport WHERE run_id = r.run_id),
            (SELECT count(*) FROM main.link_causal WHERE run_id = r.run_id)
        ]) AS row_count
    FROM main.run AS r
    WHERE list_contains($runs, r.run_id)
)
SELECT run_id, object, row_count
FROM counted
ORDER BY run_id, position
