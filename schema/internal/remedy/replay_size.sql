-- title: How much there is to replay
-- description: Callback instances and publications of a run.
-- grain: one row
-- param: run_id BIGINT  The run
SELECT (SELECT count(*) FROM main.callback_instance WHERE run_id = $run_id)
    + (SELECT count(*) FROM main.publication WHERE run_id = $run_id) AS size
