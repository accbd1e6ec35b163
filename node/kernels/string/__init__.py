"""What goes from tube to tube: encoder, aiding, twist and made-up joints."""
