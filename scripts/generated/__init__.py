"""The pages and files that `scripts/document` writes from the code's tables, models and commands."""
